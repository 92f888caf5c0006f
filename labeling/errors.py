"""How a take or a session ends early, and what a console may not do."""

from __future__ import annotations

from reach.errors import InvalidInputError, ReachError


class LabelingError(ReachError):
    """Base of this package's errors."""


class TakeEndedError(LabelingError):
    """The take under way no longer counts: it was skipped, redone, voided, or stopped.

    The journal holds the reason already; the session's loop goes on to the next work.
    """


class SessionEndingError(LabelingError):
    """The session was asked to end while its loop waited for the operator."""


class UnsafeAddressError(InvalidInputError, LabelingError):
    """The console would listen beyond this machine without a token and TLS."""


class ConsoleLinkError(InvalidInputError, LabelingError):
    """A link leads to no console that would answer."""


class OutsideSessionError(LabelingError):
    """A picture lies outside the session's folder and is not served."""
