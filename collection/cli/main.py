"""The command `reach`: which commands there are, and how an error reaches the user."""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from collection.cli.leaving import QuickExit
from reach.errors import ReachError

COMMANDS: dict[str, str] = {
    "collect": "collect",
    "status": "status",
    "console": "console",
    "label": "label",
    "replay": "replay",
    "recover": "recover",
    "export": "export",
    "import": "import_",
    "evaluate": "evaluate",
    "fit": "fit",
    "report": "report",
    "score": "score",
    "sample": "sample",
    "register": "register",
    "objects": "objects",
    "calibrate": "calibrate",
    "doctor": "doctor",
}
"""Command name -> module in collection.cli that holds a function of the same name."""


INTERRUPTED = 130
_SYSTEM_LIBRARY = re.compile(r"(lib[\w.+-]+): cannot open shared object file")


def build_app() -> typer.Typer:
    """Assemble the command line from one module a command."""
    app = typer.Typer(
        name="reach",
        help="Plan, run, label, score and export physical robot grasp trials.",
        no_args_is_help=True,
        add_completion=False,
        rich_markup_mode="markdown",
        pretty_exceptions_enable=False,
    )
    app.callback()(_options_of_reach)
    for name, module_name in COMMANDS.items():
        module = importlib.import_module(f"collection.cli.{module_name}")
        member = getattr(module, module_name)
        if isinstance(member, typer.Typer):
            app.add_typer(member, name=name)
        else:
            app.command(name)(member)
    return app


def _options_of_reach(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            is_eager=True,
            callback=lambda given: _print_version(asked=given),
            help="Print the version, and nothing else.",
        ),
    ] = False,
) -> None:
    """Take the options before the command; all act by their callbacks."""


def _print_version(*, asked: bool) -> None:
    if not asked:
        return
    print(_version())
    raise typer.Exit


def _version() -> str:
    from collection.session.versions import git_commit, package_versions

    commit = git_commit()
    release = f"reach-trials {package_versions()['reach-trials']}"
    return release if commit is None else f"{release} ({commit})"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        arguments: as typed after `reach`; the process's own if None.

    Returns:
        Exit code: 0 done, 2 bad input (one line on stderr), 130 interrupted.
    """
    command = typer.main.get_command(build_app())
    try:
        result = command.main(
            args=None if arguments is None else list(arguments),
            prog_name="reach",
            standalone_mode=False,
        )
    except ReachError as error:
        return _complain(str(error), 2)
    except BrokenPipeError:
        return 0  # the reader of our output (head, less) has seen enough
    except SystemExit as left:  # tables and help meet the closed pipe in their own way
        if not isinstance(left.__context__, BrokenPipeError):
            raise
        return 0
    except OSError as error:
        return _complain(_of_the_system(error), 2)
    except MemoryError as error:
        return _complain(f"not enough memory: {error}", 2)
    except ImportError as error:
        if (library := _SYSTEM_LIBRARY.match(str(error))) is None:
            raise
        return _complain(
            f"the system library {library[1]} is missing;"
            " as root: tests/install-system-packages runtime (names the Debian packages)",
            2,
        )
    except typer.TyperException as error:
        given = sys.argv[1:] if arguments is None else arguments
        return _complain(_naming_the_value(error.format_message(), given), 2)
    except (typer.Abort, KeyboardInterrupt):
        return _complain("interrupted", INTERRUPTED)
    if result == INTERRUPTED:  # the parser swallows a Ctrl-C in a command, and says nothing
        return _complain("interrupted", INTERRUPTED)
    return result if isinstance(result, int) else 0


def _naming_the_value(message: str, arguments: Sequence[str]) -> str:
    """Add what was typed: the parser's own message names the option only."""
    if message.startswith("No such command"):
        return f"{message.rstrip('.')}; the commands are {', '.join(COMMANDS)}"
    option = re.match(r"Invalid value for '(?:-\w', '|-\w / )?(--[\w-]+)'", message)
    if option is None:
        return message
    following = dict(zip(arguments, arguments[1:], strict=False))
    joined = {a.partition("=")[0]: a.partition("=")[2] for a in arguments if "=" in a}
    typed = {**joined, **following}.get(option[1])
    return message if typed is None or typed in message else f"{message} (given: {typed})"


def _of_the_system(error: OSError) -> str:
    """What the operating system refused: a folder that cannot be written, a full disk."""
    if error.filename is None or error.strerror is None:
        return str(error)
    return f"{error.filename}: {error.strerror.lower()}"


def _complain(message: str, code: int) -> int:
    line = " ".join(message.split())
    if line:
        print(f"error: {line}", file=sys.stderr)
    return code


def run() -> None:
    """Entry point of the command `reach`."""
    leaving = QuickExit()
    leaving.code = main()
    sys.exit(leaving.code)
