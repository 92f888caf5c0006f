"""Who operates: a person at the page, or the simulated operator."""

from __future__ import annotations

import getpass
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from collection.placing import instruction, placing_picture

if TYPE_CHECKING:
    from collection.setup import Setup
    from collection.station import Station
    from collection.trial import TrialContext
    from labeling.controller import SessionController
    from labeling.pictures import PictureShelf
    from logs.state import TakeState, TrialState

PICTURE = "how to place it"


@contextmanager
def simulated_operator(
    controller: SessionController, station: Station, setup: Setup
) -> Iterator[None]:
    """The operator of `--operator auto`, who sees what a person would see: the true object."""
    from labeling.auto import AutoOperator

    def choose_pose(trial: TrialState, take: TakeState) -> int:
        return _nearest_pose(station, setup, trial, take)

    with AutoOperator(controller, choose_pose=choose_pose):
        yield


def _nearest_pose(station: Station, setup: Setup, trial: TrialState, take: TakeState) -> int:
    """Which of the poses on the screen looks like the object on the table."""
    from reach.symmetry import pose_distance, symmetry

    assert station.simulation is not None
    T_true = station.simulation.true_T_world_object()
    sym = symmetry(setup.objects[trial.planned.object_name])
    poses = take.info.get("poses")
    assert isinstance(poses, list)
    turns = [pose_distance(sym, T_true, np.array(pose)) for pose in poses]
    return min(range(len(turns)), key=lambda n: turns[n][0] + turns[n][1] / 0.03)


@contextmanager
def web_console(
    controller: SessionController, setup: Setup, context: TrialContext
) -> Iterator[str]:
    """The page, served to this machine; yields the link that opens it."""
    from labeling.access import make_access
    from labeling.commands import Actor
    from labeling.console import Console
    from labeling.pictures import PictureShelf
    from labeling.server import ConsoleServer, free_port
    from logs.events import Source

    shelf = PictureShelf(context.session_path)
    forget = controller.listen(lambda: _offer_picture(controller, setup, shelf))
    console = Console(
        controller,
        Actor(getpass.getuser(), Source.OPERATOR),
        title=context.session_path.name,
        pictures=shelf,
        simulated=context.station.simulation is not None,
    )
    try:
        with ConsoleServer(console, make_access("127.0.0.1", free_port("127.0.0.1"))) as server:
            yield server.link
    finally:
        forget()


def _offer_picture(controller: SessionController, setup: Setup, shelf: PictureShelf) -> None:
    """Put the picture of how to place the present object on the shelf; drawn when looked at."""
    with controller.reading() as state:
        trial = state.current_trial
        if trial is None or not trial.takes:
            return
        take = trial.takes[-1].take
    if PICTURE in shelf.names(trial.trial_id, take):
        return
    obj = setup.objects[trial.planned.object_name]
    pose = setup.plan.pose_of(setup.plan.grasp(trial.planned.grasp_id))
    shelf.put(trial.trial_id, take, PICTURE, lambda: placing_picture(obj, pose))


def placing_note(setup: Setup, trial_id: str) -> str:
    """How to put the object of a trial down, in words."""
    trial = next(t for t in setup.plan.trials if t.trial_id == trial_id)
    pose = setup.plan.pose_of(setup.plan.grasp(trial.grasp_id))
    return instruction(setup.objects[trial.object_name], pose)
