"""Who operates: a person at the page, or the simulated operator."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from collection.plan.placing import how_it_lies, placing_picture

if TYPE_CHECKING:
    from collection.plan.records import Plan
    from collection.session.options import Sitting
    from collection.session.setup import Setup
    from collection.station.station import Station
    from labeling.control.controller import SessionController
    from logs.journal.state import TakeState, TrialState
    from logs.session.folder import SessionFolder
    from reach.objects import GraspObject
    from registration.frame import DepthFrame
    from registration.result import Registration

OVERLAY = "overlay"


@contextmanager
def simulated_operator(
    controller: SessionController, station: Station, setup: Setup
) -> Iterator[None]:
    """The operator of `--operator auto`, who sees what a person would see: the true object."""
    from labeling.control.auto import AutoOperator

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


class WebConsole:
    """The page, served while the session runs.

    Args:
        controller: the session's writer.
        setup: of the session.
        folder: of the session.
        sitting: who labels, and where the page is served.
        simulated: the station is simulated.
    """

    def __init__(
        self,
        controller: SessionController,
        setup: Setup,
        folder: SessionFolder,
        sitting: Sitting,
        *,
        simulated: bool,
    ) -> None:
        from labeling.display.pictures import PictureShelf

        self._controller = controller
        self._setup = setup
        self._folder = folder
        self._sitting = sitting
        self._simulated = simulated
        self._shelf = PictureShelf(folder.path)
        self._captions: dict[str, str] = {}

    @contextmanager
    def serve(self) -> Iterator[str]:
        """Serve the page; yields the link that opens it."""
        from labeling.display.console import Console
        from labeling.reviewing import blind_recording
        from labeling.server.server import ConsoleServer

        console = Console(
            self._controller,
            self._sitting.actor(),
            title=self._folder.path.name,
            pictures=self._shelf,
            recordings=lambda trial: blind_recording(self._folder, trial),
            root=self._folder.path,
            simulated=self._simulated,
        )
        access = self._sitting.access()
        self._captions = _captions(self._setup.plan, self._setup.objects)
        forget = self._controller.listen(self._offer_placing_picture)
        try:
            with ConsoleServer(console, access) as server:
                yield server.link
        finally:
            forget()

    def offer_overlay(
        self, trial_id: str, take: int, obj: GraspObject, frame: DepthFrame, found: Registration
    ) -> None:
        """Put the registration's overlay on the shelf; drawn when looked at."""

        def draw() -> bytes:
            from registration.picture import save_picture

            with TemporaryDirectory() as folder:
                path = Path(folder) / "overlay.png"
                save_picture(path, obj, frame, found)
                return path.read_bytes()

        self._shelf.put(trial_id, take, OVERLAY, draw)

    def _offer_placing_picture(self) -> None:
        """Put the picture of how to place the present object on the shelf; drawn when looked at."""
        with self._controller.reading() as state:
            trial = state.current_trial
            if trial is None or not trial.takes:
                return
            take = trial.takes[-1].take
        if self._shelf.names(trial.trial_id, take):
            return
        obj = self._setup.objects[trial.planned.object_name]
        pose = self._setup.plan.pose_of(self._setup.plan.grasp(trial.planned.grasp_id))
        self._shelf.put(
            trial.trial_id,
            take,
            self._captions[trial.planned.grasp_id],
            lambda: placing_picture(obj, pose),
        )


def _captions(plan: Plan, objects: Mapping[str, GraspObject]) -> dict[str, str]:
    """How the part of each grasp lies, in words."""
    poses = {
        (part.name, pose.index): f"{how_it_lies(objects[part.name], pose)}; the grid is 10 mm"
        for part in plan.objects
        for pose in part.poses
    }
    return {g.grasp_id: poses[g.object_name, plan.pose_of(g).index] for g in plan.grasps}
