"""Reading a station file so that a mistake is reported with its line."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, SecretStr, ValidationError

from collection.errors import StationFileError

_TABLE = re.compile(r"^\s*(\[\[?)\s*([\w.\-\"' ]+?)\s*\]\]?\s*(?:#.*)?$")
_KEY = re.compile(r"^\s*([\w\-\"'.]+)\s*=")
Place = tuple[str | int, ...]
LEFT_OUT = "**********"
UNREADABLE = "The station file is not kept: its password could not be left out."


@dataclass(frozen=True, slots=True)
class Sections:
    """A parsed file, and the line each of its keys stands on."""

    name: str
    data: dict[str, Any]
    lines: dict[Place, int]

    def error(self, place: Place, message: str) -> StationFileError:
        """An error that names the file and the line of a key, or of what holds it."""
        at = place
        while at and at not in self.lines:
            at = at[:-1]
        line = f":{self.lines[at]}" if at in self.lines else ""
        return StationFileError(f"{self.name}{line}: {message}")


def read_sections(text: str, name: str) -> Sections:
    """Parse a TOML file.

    Raises:
        StationFileError: it is not TOML; the message gives the line.
    """
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise StationFileError(f"{name}: not a TOML file: {error}") from error
    return Sections(name, data, _line_numbers(text))


def station_text(path: Path) -> str:
    """Read a station file.

    Raises:
        StationFileError: it is not text.
    """
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise StationFileError(f"{path.name}: not a text file in UTF-8: {error}") from error


def validated(
    model: type[BaseModel], data: dict[str, Any], sections: Sections, place: Place
) -> BaseModel:
    """Validate one section.

    Raises:
        StationFileError: with the line, and the valid keys of the section.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        first, *others = error.errors()
        where: Place = (*place, *first["loc"])
        message = _message(model, dict(first), where, place)
        more = f" (and {len(others)} more)" if others else ""
        raise sections.error(where, message + more) from error


def without_secrets(text: str, *sections: BaseModel) -> str:
    """A station file's text as sessions keep it: what its drivers call secret is left out.

    Args:
        text: the station file.
        sections: its validated sections, whose secrets are those that they hold as such.
    """
    secrets = {
        name: value.get_secret_value()
        for section in sections
        for name, value in ((n, getattr(section, n)) for n in type(section).model_fields)
        if isinstance(value, SecretStr)
    }
    for name, value in secrets.items():
        line = re.compile(rf"^(\s*(?:[\w\-]+\.)?[\"']?{name}[\"']?\s*=).*$", re.MULTILINE)
        text = line.sub(rf'\1 "{LEFT_OUT}"', text)
        if value:
            text = text.replace(value, LEFT_OUT)
    return text if _still_leaves_out(text, secrets) else f"# {UNREADABLE}\n"


def _still_leaves_out(text: str, secrets: dict[str, str]) -> bool:
    """Whether no value of the file is a secret, however it was written."""
    if not secrets:
        return True
    try:
        values = [*_strings(tomllib.loads(text))]
    except tomllib.TOMLDecodeError:
        return False
    return not any(secret and secret in value for secret in secrets.values() for value in values)


def _strings(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for each in value.values():
            yield from _strings(each)
    elif isinstance(value, list):
        for each in value:
            yield from _strings(each)
    elif isinstance(value, str):
        yield value


def _message(model: type[BaseModel], error: dict[str, Any], where: Place, place: Place) -> str:
    name = ".".join(str(part) for part in where)
    holder = _model_at(model, where[len(place) : -1])
    keys = ", ".join(sorted(holder.model_fields)) if holder else ""
    if error["type"] == "extra_forbidden":
        return f"unknown key {name!r}; valid keys: {keys}"
    if error["type"] == "missing":
        return f"missing key {name!r}; valid keys: {keys}"
    field = holder.model_fields.get(str(where[-1])) if holder else None
    if field is not None and field.annotation is SecretStr:
        return f"{name}: {error['msg']}"
    return f"{name}: {error['msg']}, got {error['input']!r}"


def _model_at(model: type[BaseModel], path: Place) -> type[BaseModel] | None:
    """The model of a nested section."""
    current: Any = model
    for part in path:
        if isinstance(part, int):
            continue
        field = current.model_fields.get(part)
        current = _model_in(field.annotation) if field else None
        if current is None:
            return None
    return current if isinstance(current, type) and issubclass(current, BaseModel) else None


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """The pydantic model inside `X`, `X | None` or `tuple[X, ...]`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for part in getattr(annotation, "__args__", ()):
        found = _model_in(part)
        if found is not None:
            return found
    return None


def _line_numbers(text: str) -> dict[Place, int]:
    lines: dict[Place, int] = {}
    table: Place = ()
    counts: dict[str, int] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        header, key = _TABLE.match(line), _KEY.match(line)
        if header:
            name = header.group(2)
            table = tuple(part.strip(" \"'") for part in name.split("."))
            if header.group(1) == "[[":
                index = counts.get(name, 0)
                counts[name] = index + 1
                lines.setdefault(table, number)
                table = (*table, index)
            lines.setdefault(table, number)
        elif key:
            parts = tuple(part.strip("\"'") for part in key.group(1).split("."))
            lines.setdefault((*table, *parts), number)
    return lines
