"""The emulator's RAPID: what the tests of the module stand on."""

from __future__ import annotations

from typing import Any

import pytest
from lark.exceptions import LarkError
from yumi_emulator.interpreter import Task
from yumi_emulator.language import parse_module
from yumi_emulator.runtime import Arguments, RapidError, Run
from yumi_emulator.values import RapidTypeError, to_text


class World:
    """Built-in routines for small programs: they note calls and fail on demand."""

    def __init__(self) -> None:
        self.calls: list[float] = []
        self.failures = 0
        self.procedures = {"note": self._note, "work": self._work}
        self.functions = {"double": lambda a: 2 * a.positional[0]}
        self.constants = {"err_work": 7.0, "err_other": 8.0}
        self.shared: dict[str, Any] = {}

    def _note(self, arguments: Arguments) -> Run:
        self.calls.append(arguments.positional[0])
        yield from ()

    def _work(self, arguments: Arguments) -> Run:
        yield
        if self.failures > 0:
            self.failures -= 1
            raise RapidError("ERR_WORK")


def task(body: str, world: World, data: str = "", more: str = "") -> Task:
    text = f"MODULE Small {data} PROC main() {body} ENDPROC {more} ENDMODULE"
    return Task("T", parse_module(text), world)


def run(program: Task, steps: int = 50) -> None:
    with pytest.raises(StopIteration):
        for _ in range(steps):
            program.step()


def test_trynext_goes_on_after_the_statement_that_failed_inside_a_block() -> None:
    world = World()
    world.failures = 1
    run(task("IF TRUE THEN note 1; work; note 2; ENDIF note 3; ERROR note ERRNO; TRYNEXT;", world))
    assert world.calls == [1, 7, 2, 3]


def test_retry_repeats_only_the_statement_that_failed() -> None:
    world = World()
    world.failures = 2
    run(task("note 1; work; note 2; ERROR RETRY;", world))
    assert world.calls == [1, 2] and world.failures == 0


def test_an_error_reaches_the_handler_of_the_caller() -> None:
    world = World()
    world.failures = 1
    more = "PROC inner() note 1; work; note 2; ENDPROC"
    run(task("inner; note 3; ERROR TRYNEXT;", world, more=more))
    assert world.calls == [1, 3]  # the rest of the callee is left out


def test_an_error_nobody_handles_stops_the_program() -> None:
    world = World()
    world.failures = 1
    program = task("work; note 1;", world)
    program.step()
    with pytest.raises(RapidError, match="ERR_WORK"):
        program.step()


def test_an_error_in_a_handler_is_not_handled_by_it() -> None:
    world = World()
    world.failures = 2
    program = task("work; ERROR work; TRYNEXT;", world)
    program.step()
    program.step()
    with pytest.raises(RapidError):
        program.step()


def test_raise_passes_an_error_on() -> None:
    world = World()
    world.failures = 1
    more = "PROC inner() work; ERROR note 1; RAISE; ENDPROC"
    run(task("inner; note 3; ERROR note ERRNO; TRYNEXT;", world, more=more))
    assert world.calls == [1, 7, 3]


def test_records_are_copied_and_their_components_assigned() -> None:
    world = World()
    data = "RECORD pair num a; pos b; ENDRECORD VAR pair p:=[1,[2,3,4]]; VAR pair q;"
    run(task("q:=p; q.b.y:=9; note p.b.y; note q.b.y; note q.a;", world, data))
    assert world.calls == [3, 9, 1]


def test_control_flow_and_operators() -> None:
    body = """
        FOR_:=0;
        WHILE FOR_<5 DO
            TEST FOR_ CASE 0,1: note 10; CASE 2: note 20; DEFAULT: note 30; ENDTEST
            FOR_:=FOR_+1;
        ENDWHILE
        IF FOR_=5 AND NOT (FOR_<>5 OR FALSE) THEN note -double(FOR_)/4; ELSE note 0; ENDIF
        note square(3);
    """
    world = World()
    more = "FUNC num square(num x) RETURN x*x; ENDFUNC"
    run(task(body, world, "VAR num FOR_;", more))
    assert world.calls == [10, 10, 20, 30, 30, -2.5, 9]


def test_waituntil_looks_again_each_time() -> None:
    world = World()
    program = task("WaitUntil x>2; note x;", world, "PERS num x:=0;")
    for value in (1.0, 2.0, 3.0):
        program.step()
        program.write("x", value)
    run(program)
    assert world.calls == [3]


def test_variables_start_anew_after_a_reset_and_persistents_do_not() -> None:
    world = World()
    program = task("x:=x+1; v:=v+1; note x; note v;", world, "PERS num x:=0; VAR num v:=0;")
    run(program)
    program.reset()
    run(program)
    assert world.calls == [1, 1, 2, 1]


def test_plain_persistents_are_shared_by_tasks_and_task_persistents_are_not() -> None:
    world = World()
    data = "PERS num both:=0; TASK PERS num own:=0;"
    one, other = task("note 1;", world, data), task("note 1;", world, data)
    one.write("both", 5.0)
    one.write("own", 5.0)
    assert other.read("both") == 5.0 and other.read("own") == 0.0


@pytest.mark.parametrize(
    ("data", "body"),
    [
        ("VAR num n;", 'n:="text";'),
        ("VAR bool b;", "b:=1;"),
        ("VAR pos p;", "p:=[1,2];"),
        ("VAR pos p;", "p.w:=1;"),
        ("CONST num c:=1;", "c:=2;"),
        ("", "nothing 1;"),
        ("VAR num n;", "n:=unknown;"),
        ("VAR num n;", "IF n THEN note 1; ENDIF"),
    ],
)
def test_what_a_controller_would_refuse_is_refused(data: str, body: str) -> None:
    with pytest.raises(RapidTypeError):
        task(body, World(), data).step()


@pytest.mark.parametrize(
    "text",
    [
        "MODULE M PROC main() x:=1 ENDPROC ENDMODULE",
        "MODULE M PROC main() IF TRUE note 1; ENDIF ENDPROC ENDMODULE",
        "MODULE M PROC main() ENDPROC VAR num late; ENDMODULE",
        "MODULE M PROC a_name_that_is_longer_than_thirty_two() ENDPROC ENDMODULE",
        "MODULE M PROC main() ERROR TRYNEXT; note 1 ENDPROC ENDMODULE",
    ],
)
def test_text_that_is_no_module_does_not_parse(text: str) -> None:
    with pytest.raises(LarkError):
        parse_module(text)


def test_numbers_have_single_precision() -> None:
    program = task("n:=16777217;", World(), "PERS num n:=0;")
    run(program)
    assert program.read("n") == 16777216.0


def test_values_are_written_as_the_web_services_write_them() -> None:
    program = task(
        "n:=n;", World(), 'PERS num n:=9E+09; PERS pos p:=[1,-0.5,1E-3]; PERS string s:="a";'
    )
    assert [to_text(program.read(name)) for name in "nps"] == ["9E+09", "[1,-0.5,0.001]", '"a"']
