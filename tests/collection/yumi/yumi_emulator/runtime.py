"""What a running RAPID task is made of: errors, frames, interrupts, and what leaves a routine."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, Protocol

from yumi_emulator.language import Routine

Run = Iterator[None]


class RapidError(Exception):
    """A recoverable error: what ERRNO names."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.name = name.lower()


@dataclass
class Arguments:
    positional: list[Any] = field(default_factory=list)
    optional: dict[str, Any] = field(default_factory=dict)


class Builtins(Protocol):
    """What the controller brings: instructions, functions, constants."""

    procedures: dict[str, Callable[[Arguments], Run]]
    functions: dict[str, Callable[[Arguments], Any]]
    constants: dict[str, Any]
    shared: dict[str, Any]

    def now(self) -> float:
        """Time [s]."""
        ...


@dataclass
class Interrupt:
    """A trap routine, and when it is due."""

    trap: str
    period: float = float("inf")
    due: float = float("inf")


@dataclass
class Frame:
    routine: Routine
    variables: dict[str, Any]
    types: dict[str, str]
    handling: bool = False


class Return(Exception):  # noqa: N818 - control flow, not an error
    """RETURN leaves the routine."""

    def __init__(self, value: Any) -> None:
        self.value = value


class TryNext(Exception):  # noqa: N818 - control flow, not an error
    """TRYNEXT leaves the ERROR clause."""


class Retry(Exception):  # noqa: N818 - control flow, not an error
    """RETRY leaves the ERROR clause."""
