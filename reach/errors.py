"""What can be wrong with a user's input, as types.

Every package derives its own errors from [ReachError][]; the command line prints the message
of any of them as one line and exits with code 2. A message says what was wrong, with which
value, and what would be valid.
"""

from __future__ import annotations

from collections.abc import Iterable


class ReachError(Exception):
    """Base of every error this project raises on purpose."""


class InvalidInputError(ReachError, ValueError):
    """A value that no computation here can accept: NaN, negative friction, zero mass, ..."""


class InvalidTransformError(InvalidInputError):
    """A matrix that is not a rigid transform."""


class InvalidMeshError(InvalidInputError):
    """A mesh that is open, inverted, degenerate, or of an absurd size."""


class InvalidPadError(InvalidInputError):
    """A pad polygon that is not planar, not convex, or has no area."""


class UnknownNameError(InvalidInputError):
    """A name that is not among the valid ones."""

    def __init__(self, what: str, name: str, choices: Iterable[str]) -> None:
        listed = ", ".join(sorted(choices)) or "none"
        super().__init__(f"unknown {what} {name!r}; valid: {listed}")
