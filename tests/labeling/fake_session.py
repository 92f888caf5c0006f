"""A session without a robot, driven through the controller; also the victim of the kill tests.

Usage: fake_session.py FOLDER TRIALS. Creates or resumes the session and runs it to its end. The
outcome of a trial follows from its number, so that an invented or mixed-up label shows.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from labeling.control.auto import AutoOperator
from labeling.control.controller import SessionController
from labeling.control.take import Take
from labeling.errors import SessionEndingError, TakeEndedError
from logs.journal.events import (
    FailureReason,
    Outcome,
    Phase,
    Scored,
    SensorVerdict,
    Source,
    TrueOutcome,
)
from logs.journal.state import PlannedEntry, SessionState
from logs.session.folder import SessionDescriptor, SessionFolder, open_segment

SETUP = {"robot": "r1", "camera": "c1", "calibration": "k1", "plan": "p1"}


def truth_of(number: int) -> TrueOutcome:
    if number % 3 == 0:
        return TrueOutcome(outcome=Outcome.FAILURE, reason=FailureReason.MISSED)
    return TrueOutcome(outcome=Outcome.SUCCESS, rotated=number % 5 == 0)


def describe(trials: int) -> SessionDescriptor:
    return SessionDescriptor(
        session_id="5e55104e-0000-4000-8000-000000000000",
        created_ns=1,
        seed=7,
        config={},
        trials=tuple(
            PlannedEntry(
                number=number,
                trial_id=f"00000000-0000-4000-8000-{number:012d}",
                grasp_id=f"g{number}",
                object_name="cube",
            )
            for number in range(1, trials + 1)
        ),
        fingerprints=SETUP,
        simulated=True,
    )


def run_take(folder: SessionFolder, take: Take, number: int) -> None:
    """Place, see, execute; trial 2 is ambiguous, the first take of trial 4 finds no pose."""
    take.wait_placed()
    take.advance(Phase.CAPTURE)
    take.advance(Phase.REGISTER, {"fitness": 0.9})
    if number == 2:
        assert take.confirm_pose({"rivals": [{"angle": 3.14}]}) == 0
    if number == 4 and take.number == 1:
        take.void("no pose found")
        return
    take.advance(Phase.EXECUTE)
    recorded = folder.trial_folder(take.trial_id, take.number)
    recorded.mkdir(parents=True, exist_ok=True)
    (recorded / "trial.mcap").write_bytes(b"record")
    truth = truth_of(number)
    lifted = truth.outcome is Outcome.SUCCESS
    record = str((recorded / "trial.mcap").relative_to(folder.path))
    take.record_executed(record, SensorVerdict(lifted=lifted, truth=truth))


def run_loop(folder: SessionFolder, controller: SessionController) -> None:
    while (work := controller.next_work()) is not None:
        take = controller.begin(work)
        try:
            if not take.executed:
                run_take(folder, take, work.planned.number)
            if take.executed and take.await_label().kind == "label":
                score = Scored(
                    trial_id=take.trial_id, take=take.number, model="reach", version="1", value=0.5
                )
                controller.record(score)
            take.reset()
        except TakeEndedError:
            continue
        except SessionEndingError:
            return


def run(path: Path, trials: int) -> None:
    if path.exists():
        folder = SessionFolder.open(path)
    else:
        folder = SessionFolder.create(path, describe(trials), {"plan.json": '{"seed": 7}'})
    journal = folder.open_journal()
    state = SessionState.fold(folder.descriptor.trials, journal.entries)
    open_segment(journal, state, SETUP, operator="sim", source=Source.OPERATOR_SIM)
    controller = SessionController(journal, state)
    with AutoOperator(controller):
        run_loop(folder, controller)
    controller.close("finished")


if __name__ == "__main__":
    begun = time.monotonic()
    run(Path(sys.argv[1]), int(sys.argv[2]))
    print(f"{time.monotonic() - begun:.2f} s")
