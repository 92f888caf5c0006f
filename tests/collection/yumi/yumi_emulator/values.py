"""RAPID values: num, bool, string and records, and their text on the web services."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

ATOMIC = {"num", "bool", "string", "errnum", "intnum"}
RECORDS: dict[str, dict[str, str]] = {
    "pos": dict.fromkeys("xyz", "num"),
    "orient": {f"q{i}": "num" for i in range(1, 5)},
    "pose": {"trans": "pos", "rot": "orient"},
    "robjoint": {f"rax_{i}": "num" for i in range(1, 7)},
    "extjoint": {f"eax_{letter}": "num" for letter in "abcdef"},
    "confdata": dict.fromkeys(("cf1", "cf4", "cf6", "cfx"), "num"),
    "jointtarget": {"robax": "robjoint", "extax": "extjoint"},
    "robtarget": {"trans": "pos", "rot": "orient", "robconf": "confdata", "extax": "extjoint"},
    "speeddata": dict.fromkeys(("v_tcp", "v_ori", "v_leax", "v_reax"), "num"),
    "zonedata": {
        "finep": "bool",
        **dict.fromkeys(
            ("pzone_tcp", "pzone_ori", "pzone_eax", "zone_ori", "zone_leax", "zone_reax"), "num"
        ),
    },
    "loaddata": {
        "mass": "num",
        "cog": "pos",
        "aom": "orient",
        **dict.fromkeys(("ix", "iy", "iz"), "num"),
    },
    "tooldata": {"robhold": "bool", "tframe": "pose", "tload": "loaddata"},
}


class RapidTypeError(Exception):
    """The real controller would refuse to load or run this."""


@dataclass
class Record:
    type_name: str
    fields: dict[str, Any]

    def numbers(self) -> list[float]:
        """All components, depth first."""
        flat: list[float] = []
        for value in self.fields.values():
            flat.extend(value.numbers() if isinstance(value, Record) else [float(value)])
        return flat


class Types:
    """The built-in record types and those of a module."""

    def __init__(self, records: dict[str, dict[str, str]]) -> None:
        self._records = RECORDS | records

    def typed(self, type_name: str, value: Any) -> Any:
        """A copy of a value as a type; an aggregate (list) takes the type's shape."""
        if type_name in ATOMIC:
            return _atomic(type_name, value)
        components = self._records.get(type_name)
        if components is None:
            raise RapidTypeError(f"unknown type {type_name}")
        if isinstance(value, Record):
            if value.type_name != type_name:
                raise RapidTypeError(f"{value.type_name} where {type_name} is expected")
            return copy.deepcopy(value)
        if not isinstance(value, list) or len(value) != len(components):
            raise RapidTypeError(f"{value!r} is no {type_name}")
        fields = {
            name: self.typed(component, item)
            for (name, component), item in zip(components.items(), value, strict=True)
        }
        return Record(type_name, fields)

    def default(self, type_name: str) -> Any:
        """What a variable without initial value holds."""
        atoms = {"num": 0.0, "errnum": 0.0, "intnum": 0.0, "bool": False, "string": ""}
        if type_name in atoms:
            return atoms[type_name]
        if type_name not in self._records:
            raise RapidTypeError(f"unknown type {type_name}")
        fields = {name: self.default(part) for name, part in self._records[type_name].items()}
        return Record(type_name, fields)

    def component_type(self, type_name: str, component: str) -> str:
        try:
            return self._records[type_name][component]
        except KeyError:
            raise RapidTypeError(f"{type_name} has no component {component}") from None


def to_text(value: Any) -> str:
    """As the web services write a value."""
    if isinstance(value, Record):
        return "[" + ",".join(to_text(part) for part in value.fields.values()) + "]"
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    if isinstance(value, str):
        return f'"{value}"'
    return "9E+09" if value == np.float32(9e9) else f"{value:.7G}"


def _atomic(type_name: str, value: Any) -> Any:
    if type_name == "bool":
        fits = isinstance(value, bool)
    elif type_name == "string":
        fits = isinstance(value, str) and len(value) <= 80
    else:
        fits = isinstance(value, float)
    if not fits:
        raise RapidTypeError(f"{value!r} is no {type_name}")
    # RAPID's num has single precision: integers are exact up to 8388608.
    return float(np.float32(value)) if type_name == "num" else value
