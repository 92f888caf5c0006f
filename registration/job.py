"""One registration under way: the divided image, and searches over its candidates."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from reach.arrays import FloatArray
from reach.objects import GraspObject
from reach.stable_poses import StablePose, stable_poses
from reach.symmetry import pose_distance, symmetry
from registration.close_look import CloseLook
from registration.evidence import Evidence, Weigher
from registration.frame import DepthFrame
from registration.mesh_model import mesh_model
from registration.observation import Scan, scan
from registration.options import RegistrationOptions
from registration.search import Hypothesis, Search
from registration.table import fit_table

FACE_ERROR = 3e-5
"""Standard deviation of a printed face against its mesh, as a whole [m]."""


class Job:
    """The image divided into table and candidates, ready to be searched.

    Args:
        obj: the part.
        frame: the depth image.
        options: thresholds and choices.
        seed: of the random draws.

    Raises:
        NoTableError: no level plane in the image.
        TooFewPointsError: nothing large enough stands on the table.
    """

    def __init__(
        self, obj: GraspObject, frame: DepthFrame, options: RegistrationOptions, seed: int
    ) -> None:
        self.obj, self.frame, self.options, self.seed = obj, frame, options, seed
        self.timings: dict[str, float] = {}
        self._weighers: dict[int, Weigher] = {}
        self.profile = options.profile_for(frame)
        with self.timed("prepare"):
            self.model = mesh_model(obj)
            self.poses: tuple[StablePose, ...] = stable_poses(obj)
            self.sym = symmetry(obj)
        with self.timed("table"):
            self.table = fit_table(
                frame,
                np.random.default_rng(seed),
                noise_bounds=self.profile.noise_bounds,
                max_tilt=options.max_table_tilt,
            )
        with self.timed("segment"):
            self.scan = scan(
                frame, self.table, model=self.model, profile=self.profile, options=options
            )
            self.groups = self._searches(self.scan, self.scan.groups())

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Add the CPU time of a block to a stage."""
        start = time.process_time()
        try:
            yield
        finally:
            self.timings[stage] = self.timings.get(stage, 0.0) + time.process_time() - start

    def on_table(self, poses: Sequence[StablePose], stage: str) -> list[Hypothesis]:
        """Search stable poses over all groups of components, by rising cost."""
        return self._run(self.groups, lambda search: search.on_table(poses), stage)

    def parted_components(self, stage: str) -> list[Hypothesis]:
        """Search all stable poses over parts of what seemed to be one thing.

        Two parts may stand together, or a hand may hide a corner: first each component alone,
        then, if that explains nothing, components parted where the depth jumps.
        """
        with self.timed(stage):
            searches = self._searches(self.scan, self.scan.singles())
        found = self._run(searches, lambda search: search.on_table(self.poses), stage)
        if any(hypothesis.cost <= self.profile.max_cost for hypothesis in found):
            return found
        with self.timed(stage):
            parted = scan(
                self.frame,
                self.table,
                model=self.model,
                profile=self.profile,
                options=self.options,
                split=True,
            )
            searches = self._searches(parted, parted.subsets())
        return found + self._run(searches, lambda search: search.on_table(self.poses), stage)

    def anywhere(self, stage: str) -> list[Hypothesis]:
        """Search all orientations over all groups of components, by rising cost."""
        return self._run(self.groups, lambda search: search.anywhere(), stage)

    def weigh(self, first: Hypothesis, others: Sequence[Hypothesis]) -> Evidence:
        """Evidence for a hypothesis against others of the same search, at least one."""
        search = first.search
        weigher = self._weighers.get(id(search.seen))
        if weigher is None:
            weigher = self._weighers[id(search.seen)] = Weigher(
                self.model,
                search.seen,
                tolerance=search.fine_tolerance,
                noise=search.depth_noise,
                bias=self._bias,
            )
        return weigher.weigh(
            first.T_camera_object, np.stack([other.T_camera_object for other in others])
        )

    def close_look(self, search: Search) -> CloseLook:
        """The slow comparison of poses in a search's image."""
        return CloseLook(search, self._bias)

    def differ(self, a: FloatArray, b: FloatArray) -> bool:
        """Whether two poses are not the same up to the part's symmetry, as far as it matters."""
        turn, shift = pose_distance(self.sym, a, b)
        return (
            turn > self.options.max_turn_error
            or shift > self.options.max_shift_error
            or self.model.surface_distance(a, b) > self.profile.distinct
        )

    @property
    def _bias(self) -> float:
        """Standard deviation of the error that all depths share [m]."""
        return float(np.hypot(self.profile.bias, FACE_ERROR))

    def _run(
        self,
        searches: Sequence[Search],
        how: Callable[[Search], list[Hypothesis]],
        stage: str,
    ) -> list[Hypothesis]:
        with self.timed(stage):
            found = [hypothesis for search in searches for hypothesis in how(search)]
        return sorted(found, key=lambda hypothesis: hypothesis.cost)

    def _searches(self, divided: Scan, groups: Sequence[tuple[int, ...]]) -> list[Search]:
        return [
            Search(self.model, divided.observation(group), self.profile, self.table.noise)
            for group in groups
        ]
