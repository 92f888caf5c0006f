"""Executes one RAPID task from its module's text; built-in routines come from the controller.

A task is a generator: it runs until it has to wait (for a condition, for the arm) and yields.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator
from typing import Any

from lark import Tree

from yumi_emulator.language import Data, Module, Routine
from yumi_emulator.runtime import (
    Arguments,
    Builtins,
    Frame,
    Interrupt,
    RapidError,
    Retry,
    Return,
    Run,
    TryNext,
)
from yumi_emulator.values import RapidTypeError, Record, Types

INSTRUCTIONS = {"waituntil", "itimer", "idelete"}
"""What the interpreter itself carries out; all else comes from the controller."""


_ARITHMETIC: dict[str, Callable[[Any, Any], Any]] = {
    "add": operator.add,
    "subtract": operator.sub,
    "multiply": operator.mul,
    "divide": operator.truediv,
}
_COMPARISONS: dict[str, Callable[[Any, Any], bool]] = {
    "=": operator.eq,
    "<>": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


class Task:
    """One task with its module loaded; persistent data outlive a reset of the pointer."""

    def __init__(self, name: str, module: Module, builtins: Builtins) -> None:
        self.name = name
        self.module = module
        self.types = Types(module.records)
        self._builtins = builtins
        self._task_data: dict[str, Any] = {}
        self._errno: float | None = None
        for data in module.data.values():
            if data.storage in ("pers", "task_pers"):
                self._store(data).setdefault(data.name, self._initial(data))
        self.reset()

    def reset(self) -> None:
        """Move the program pointer to main; variables take their initial values."""
        for data in self.module.data.values():
            if data.storage in ("var", "const"):
                self._task_data[data.name] = self._initial(data)
        self._interrupts: dict[float, Interrupt] = {}
        self._run = self._routine(self.module.routines["main"], [])

    def step(self) -> None:
        """Run the trap routines that are due, then until the program has to wait.

        Raises:
            RapidError: nothing handled it; the program stops.
            StopIteration: main has ended.
        """
        for interrupt in list(self._interrupts.values()):
            if self._builtins.now() >= interrupt.due:
                interrupt.due = self._builtins.now() + interrupt.period
                self._at_once(self.module.routines[interrupt.trap], [])
        next(self._run)

    def read(self, name: str) -> Any:
        """A persistent variable, as the web services see it."""
        return self._store(self._persistent(name))[name.lower()]

    def write(self, name: str, value: Any) -> None:
        data = self._persistent(name)
        self._store(data)[data.name] = self.types.typed(data.type_name, value)

    def constant(self, tree: Tree) -> Any:
        """The value of an expression without names (a literal sent over the web services)."""
        return self._value(Frame(self.module.routines["main"], {}, {}), tree)

    def _persistent(self, name: str) -> Data:
        data = self.module.data.get(name.lower())
        if data is None or data.storage not in ("pers", "task_pers"):
            raise KeyError(name)
        return data

    def _store(self, data: Data) -> dict[str, Any]:
        return self._builtins.shared if data.storage == "pers" else self._task_data

    def _initial(self, data: Data) -> Any:
        if data.initial is None:
            return self.types.default(data.type_name)
        return self.types.typed(data.type_name, self.constant(data.initial))

    # ---- routines and statements

    def _routine(self, routine: Routine, arguments: list[Any]) -> Run:
        types = {name: type_name for name, type_name in routine.parameters}
        variables = {
            name: self.types.typed(type_name, value)
            for (name, type_name), value in zip(routine.parameters, arguments, strict=True)
        }
        frame = Frame(routine, variables, types)
        for data in routine.data:
            types[data.name] = data.type_name
            variables[data.name] = self._initial(data)
        try:
            yield from self._statements(frame, routine.statements)
        except Return as result:
            return result.value
        if routine.returns:
            raise RapidTypeError(f"{routine.name} ends without RETURN")

    def _statements(self, frame: Frame, tree: Tree) -> Run:
        for statement in tree.children:
            yield from self._statement(frame, statement)

    def _statement(self, frame: Frame, tree: Tree) -> Run:
        while True:
            try:
                yield from getattr(self, f"_do_{tree.data}")(frame, tree)
                return
            except RapidError as error:
                if frame.routine.handler is None or frame.handling:
                    raise
                if not (yield from self._handle(frame, error)):
                    return

    def _handle(self, frame: Frame, error: RapidError) -> Iterator[None]:
        """Run the routine's ERROR clause; whether the statement shall be tried again."""
        self._errno, frame.handling = self._errno_of(error), True
        try:
            yield from self._statements(frame, frame.routine.handler)
        except TryNext:
            frame.handling = False
            return False
        except Retry:
            frame.handling = False
            return True
        raise RapidTypeError(f"the ERROR clause of {frame.routine.name} leads nowhere")

    def _errno_of(self, error: RapidError) -> float:
        return float(self._builtins.constants[error.name])

    def _do_assign(self, frame: Frame, tree: Tree) -> Run:
        reference, expression = tree.children
        name, *path = (token.lower() for token in reference.children)
        store, type_name = self._place(frame, name)
        holder, key = store, name
        for component in path:
            holder = holder[key].fields
            type_name, key = self.types.component_type(type_name, component), component
        holder[key] = self.types.typed(type_name, self._value(frame, expression))
        yield from ()

    def _do_call(self, frame: Frame, tree: Tree) -> Run:
        name, arguments = tree.children[0].lower(), tree.children[1]
        if name == "waituntil":
            while not self._value(frame, arguments.children[0]):
                yield
            return
        values = self._arguments(frame, arguments)
        if name == "itimer":
            period, number = values.positional
            interrupt = self._interrupts[number]
            interrupt.period, interrupt.due = period, self._builtins.now() + period
        elif name == "idelete":
            self._interrupts.pop(values.positional[0], None)
        elif name in self.module.routines:
            yield from self._routine(self.module.routines[name], values.positional)
        elif name in self._builtins.procedures:
            yield from self._builtins.procedures[name](values)
        else:
            raise RapidTypeError(f"unknown procedure {name}")

    def _do_connect(self, frame: Frame, tree: Tree) -> Run:
        variable, trap = (token.lower() for token in tree.children)
        number = len(self._interrupts) + 1.0
        store, _ = self._place(frame, variable)
        store[variable] = number
        self._interrupts[number] = Interrupt(trap)
        yield from ()

    def _do_if(self, frame: Frame, tree: Tree) -> Run:
        condition, statements, *others, otherwise = tree.children
        branches = [(condition, statements)] + [tuple(other.children) for other in others]
        for test, body in branches:
            if self._truth(frame, test):
                yield from self._statements(frame, body)
                return
        if otherwise is not None:
            yield from self._statements(frame, otherwise.children[0])

    def _do_while(self, frame: Frame, tree: Tree) -> Run:
        condition, statements = tree.children
        while self._truth(frame, condition):
            yield from self._statements(frame, statements)

    def _do_test(self, frame: Frame, tree: Tree) -> Run:
        subject, *cases, default = tree.children
        value = self._value(frame, subject)
        for case in cases:
            *choices, statements = case.children
            if any(self._value(frame, choice) == value for choice in choices):
                yield from self._statements(frame, statements)
                return
        if default is not None:
            yield from self._statements(frame, default.children[0])

    def _do_return(self, frame: Frame, tree: Tree) -> Run:
        (expression,) = tree.children
        value = None if expression is None else self._value(frame, expression)
        returns = frame.routine.returns
        raise Return(self.types.typed(returns, value) if returns else None)
        yield  # a generator, like all statements

    def _do_raise(self, frame: Frame, tree: Tree) -> Run:
        code = self._errno if tree.children[0] is None else self._value(frame, tree.children[0])
        names = {
            value: name
            for name, value in self._builtins.constants.items()
            if name.startswith("err_")
        }
        raise RapidError(names[code])
        yield

    def _do_trynext(self, frame: Frame, tree: Tree) -> Run:
        raise TryNext
        yield

    def _do_retry(self, frame: Frame, tree: Tree) -> Run:
        raise Retry
        yield

    # ---- expressions

    def _arguments(self, frame: Frame, tree: Tree | None) -> Arguments:
        result = Arguments()
        for child in tree.children if tree is not None else ():
            if child.data == "optional":
                name, expression = child.children
                switch = expression is None
                result.optional[name.lower()] = True if switch else self._value(frame, expression)
            else:
                result.positional.append(self._value(frame, child))
        return result

    def _truth(self, frame: Frame, tree: Tree) -> bool:
        return self.types.typed("bool", self._value(frame, tree))

    def _value(self, frame: Frame, tree: Tree) -> Any:
        kind, children = tree.data, tree.children
        if kind == "number":
            return float(children[0])
        if kind == "string":
            return children[0][1:-1]
        if kind in ("true", "false"):
            return kind == "true"
        if kind == "aggregate":
            return [self._value(frame, child) for child in children]
        if kind == "reference":
            return self._lookup(frame, [token.lower() for token in children])
        if kind == "function":
            return self._function(frame, children[0].lower(), children[1])
        if kind == "compare":
            left, symbol, right = children
            return _COMPARISONS[symbol](self._value(frame, left), self._value(frame, right))
        values = [self._value(frame, child) for child in children]
        if kind == "negative":
            return -self.types.typed("num", values[0])
        if kind in _ARITHMETIC:
            return _ARITHMETIC[kind](*(self.types.typed("num", value) for value in values))
        truths = [self.types.typed("bool", value) for value in values]
        return {
            "and_": all(truths),
            "or_": any(truths),
            "xor": sum(truths) == 1,
            "not_": not truths[0],
        }[kind]

    def _function(self, frame: Frame, name: str, arguments: Tree | None) -> Any:
        values = self._arguments(frame, arguments)
        if name in self._builtins.functions:
            return self._builtins.functions[name](values)
        routine = self.module.routines.get(name)
        if routine is None or routine.returns is None:
            raise RapidTypeError(f"unknown function {name}")
        return self._at_once(routine, values.positional)

    def _at_once(self, routine: Routine, arguments: list[Any]) -> Any:
        """Run a routine that must not wait: a function, a trap."""
        try:
            next(self._routine(routine, arguments))
        except StopIteration as finished:
            return finished.value
        raise RapidTypeError(f"{routine.name} waits")

    def _lookup(self, frame: Frame, path: list[str]) -> Any:
        if path == ["errno"]:
            return self._errno
        if path[0] in frame.variables:
            value = frame.variables[path[0]]
        elif path[0] in self.module.data:
            value = self._store(self.module.data[path[0]])[path[0]]
        elif path[0] in self._builtins.constants:
            value = self._builtins.constants[path[0]]
        else:
            raise RapidTypeError(f"unknown name {path[0]}")
        for component in path[1:]:
            if not isinstance(value, Record) or component not in value.fields:
                raise RapidTypeError(f"{'.'.join(path)}: no component {component}")
            value = value.fields[component]
        return value

    def _place(self, frame: Frame, name: str) -> tuple[dict[str, Any], str]:
        if name in frame.variables:
            return frame.variables, frame.types[name]
        data = self.module.data.get(name)
        if data is None or data.storage == "const":
            raise RapidTypeError(f"cannot assign to {name}")
        return self._store(data), data.type_name
