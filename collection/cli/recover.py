"""`reach recover`: repair a session after a crash."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer


def recover(
    session: Annotated[Path, typer.Argument(help="The session's folder.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Save unfinished records and bring journal, records and index together.

    Nothing is deleted: originals stay beside what was saved. Sessions do this by themselves
    when they start; it is harmless on a healthy session. The exit code is 1 if something was
    damaged, 0 otherwise.

    - `reach recover sessions/monday`
    """
    from logs.record.records import Severity
    from logs.session.recovery import recover_session

    report = recover_session(session)
    damaged = any(finding.severity is Severity.ERROR for finding in report.findings)
    if as_json:
        findings = [asdict(finding) for finding in report.findings]
        print(json.dumps({"takes": report.takes, "findings": findings}))
        raise typer.Exit(int(damaged))
    for finding in report.findings:
        print(f"{finding.severity.value.upper():>7}  {finding.place}: {finding.text}")
    told = f"{len(report.findings)} findings" if report.findings else "nothing to repair"
    print(f"{report.takes} takes checked, {told}")
    raise typer.Exit(int(damaged))
