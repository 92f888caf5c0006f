"""RAPID values as the controller's web services write and read them.

`[1,TRUE,"text",[0.5,9E+09]]` is a list of a number, a truth value, a string and a list.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from collection.errors import RobotError

ABSENT_AXIS = 9e9
"""What RAPID writes for an external axis that is not there."""

_TOKEN = re.compile(
    r'\s*(?:(?P<mark>[\[\],])|"(?P<string>[^"]*)"|(?P<word>TRUE|FALSE)'
    r"|(?P<number>[-+]?\d+(?:\.\d+)?(?:E[-+]?\d+)?))\s*",
    re.IGNORECASE,
)


def to_rapid(value: object) -> str:
    """Write numbers, truth values, strings and nested sequences as one RAPID literal.

    Raises:
        TypeError: the value is of another type.
    """
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    if isinstance(value, int | float):
        # RAPID's num has single precision: more digits would only be lost.
        return "9E+09" if value == ABSENT_AXIS else f"{value:.8G}"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, Sequence):
        return "[" + ",".join(to_rapid(part) for part in value) + "]"
    raise TypeError(f"{type(value).__name__} has no RAPID literal")


def from_rapid(text: str) -> object:
    """Read a RAPID literal into floats, truth values, strings and lists.

    Raises:
        RobotError: the text is no literal.
    """
    tokens = _tokens(text)
    value = _value(next(tokens, ("end", "")), tokens, text)
    if next(tokens, None) is not None:
        raise RobotError(f"the controller sent {text!r}, which goes on after a RAPID value")
    return value


def _tokens(text: str) -> Iterator[tuple[str, str]]:
    position = 0
    while position < len(text):
        found = _TOKEN.match(text, position)
        if found is None:
            raise RobotError(f"the controller sent {text!r}, which is no RAPID value")
        yield found.lastgroup or "", found.group(found.lastgroup or 0)
        position = found.end()


def _value(token: tuple[str, str], tokens: Iterator[tuple[str, str]], text: str) -> object:
    kind, content = token
    if kind == "string":
        return content
    if kind == "word":
        return content.upper() == "TRUE"
    if kind == "number":
        return float(content)
    if token == ("mark", "["):
        return _list(tokens, text)
    raise RobotError(f"the controller sent {text!r}, which is no complete RAPID value")


def _list(tokens: Iterator[tuple[str, str]], text: str) -> list[object]:
    values: list[object] = []
    while True:
        values.append(_value(next(tokens, ("end", "")), tokens, text))
        mark = next(tokens, ("end", ""))
        if mark == ("mark", "]"):
            return values
        if mark != ("mark", ","):
            raise RobotError(f"the controller sent {text!r}, which is no complete RAPID value")
