"""RAPID text to a syntax tree, and the named parts of a module."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

from lark import Lark, Tree


@dataclass(frozen=True)
class Data:
    """A declaration: `storage` is var, const, pers (shared by all tasks) or task_pers."""

    name: str
    type_name: str
    storage: str
    local: bool
    initial: Tree | None


@dataclass(frozen=True)
class Routine:
    name: str
    returns: str | None
    parameters: tuple[tuple[str, str], ...]
    local: bool
    data: tuple[Data, ...]
    statements: Tree
    handler: Tree | None


@dataclass(frozen=True)
class Module:
    """Names are in lower case: RAPID does not tell case apart."""

    name: str
    records: dict[str, dict[str, str]]
    data: dict[str, Data]
    routines: dict[str, Routine]


@cache
def _grammar() -> Lark:
    text = Path(__file__).with_name("rapid.lark").read_text()
    starts = ["module", "expression"]
    return Lark(text, start=starts, parser="lalr", propagate_positions=True)


def parse_expression(text: str) -> Tree:
    return _grammar().parse(text, start="expression")


def parse_module(text: str) -> Module:
    tree = _grammar().parse(text, start="module")
    name, *parts = tree.children
    records, data, routines = {}, {}, {}
    for part in parts:
        if part.data == "record":
            record_name, *components = (child for child in part.children)
            records[record_name.lower()] = {
                component.children[1].lower(): component.children[0].lower()
                for component in components
            }
        elif part.data == "data":
            declared = _data(part)
            data[declared.name] = declared
        else:
            routine = _routine(part)
            routines[routine.name] = routine
    return Module(name.lower(), records, data, routines)


def _data(tree: Tree) -> Data:
    local, storage, type_name, name, initial = tree.children
    return Data(name.lower(), type_name.lower(), storage.data, local is not None, initial)


def _routine(tree: Tree) -> Routine:
    if tree.data == "trap":
        local, name, body = tree.children
        returns, parameters, name = [], None, name.lower()
    else:
        local, *head, parameters, body = tree.children
        *returns, name = (token.lower() for token in head)
    *data, statements, handler = body.children
    return Routine(
        name=name,
        returns=returns[0] if returns else None,
        parameters=tuple(
            (p.children[1].lower(), p.children[0].lower())
            for p in (parameters.children if parameters else ())
        ),
        local=local is not None,
        data=tuple(_data(part) for part in data),
        statements=statements,
        handler=handler.children[0] if handler else None,
    )
