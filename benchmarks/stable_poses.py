"""Are predicted stable poses what dropped parts come to rest in? Drops them in MuJoCo.

Only the convex hull of a part can touch a flat table, so the hull with the part's own mass and
inertia is dropped: exact, and fast. Each drop starts with a uniform random orientation, its
lowest point a little over the table.

    .venv/bin/python benchmarks/stable_poses.py --drops 300 --height 0.01
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.stats import spearmanr

from collection.objects import OBJECT_NAMES, load_object
from reach.arrays import FloatArray, IntArray
from reach.hull import convex_hull
from reach.objects import GraspObject
from reach.stable_poses import StablePose, stable_poses
from reach.symmetry import symmetry

LONGEST_DROP = 6.0
AT_REST = (0.02, 0.3)
"""Speeds [m/s, rad/s] below which a part has come to rest, ..."""
REST_TIME = 0.3
"""... for this long [s]."""
SAME_POSE = np.radians(15.0)


@dataclass(frozen=True)
class Comparison:
    """Predicted and simulated shares of a part's stable poses."""

    predicted: FloatArray
    simulated: FloatArray
    elsewhere: float
    """Share of drops that ended in none of the poses, or never came to rest."""

    @property
    def rank_correlation(self) -> float:
        """Spearman's, over poses; one if there is one pose."""
        if len(self.predicted) < 2:
            return 1.0
        if np.ptp(self.simulated) == 0:
            return 0.0
        return float(spearmanr(self.predicted, self.simulated).statistic)

    @property
    def top_agrees(self) -> bool:
        """Whether the likeliest pose is the commonest, ties within three percent included."""
        return bool(self.predicted[self.simulated.argmax()] >= self.predicted.max() - 0.03)

    @property
    def total_variation(self) -> float:
        """Half the sum of differences: share of drops that the prediction misplaces."""
        gap = np.abs(self.predicted - self.simulated).sum() + self.elsewhere
        return float(0.5 * gap)


def compare(part: GraspObject, drops: int, seed: int, height: float) -> Comparison:
    """Drop a part many times from a height [m] and compare where it rests with the prediction."""
    poses = stable_poses(part, 0.0)
    rested = [_pose_of(part, poses, down) for down in drop(part, drops, seed, height)]
    counts = np.bincount(np.array(rested) + 1, minlength=len(poses) + 1) / drops
    return Comparison(np.array([pose.probability for pose in poses]), counts[1:], counts[0])


def drop(part: GraspObject, drops: int, seed: int, height: float) -> list[FloatArray | None]:
    """Direction of the object that points down after each drop, None if it did not rest."""
    model = _model(part)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(seed)
    vertices = part.vertices - part.com
    return [_drop_once(model, data, vertices, rng, height) for _ in range(drops)]


def _drop_once(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    vertices: FloatArray,
    rng: np.random.Generator,
    height: float,
) -> FloatArray | None:
    mujoco.mj_resetData(model, data)
    quaternion = rng.standard_normal(4)
    quaternion /= np.linalg.norm(quaternion)
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, quaternion)
    lowest = float((vertices @ rotation.reshape(3, 3)[2]).min())
    data.qpos[:] = [0, 0, height - lowest, *quaternion]
    quiet = 0.0
    while data.time < LONGEST_DROP:
        mujoco.mj_step(model, data)
        slow = (
            np.linalg.norm(data.qvel[:3]) < AT_REST[0]
            and np.linalg.norm(data.qvel[3:]) < AT_REST[1]
        )
        quiet = quiet + model.opt.timestep if slow else 0.0
        if quiet >= REST_TIME:
            return -data.xmat[1].reshape(3, 3)[2]
    return None


def _model(part: GraspObject) -> mujoco.MjModel:
    """A floor and the part's hull, its frame at the center of mass with the object's axes."""
    hull = convex_hull(part.vertices, part.com)
    spec = mujoco.MjSpec()
    spec.option.timestep = 0.001
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10
    spec.add_mesh(name="hull", uservert=hull.triangles.reshape(-1))
    contact = {"friction": [0.5, 0.001, 0.0002], "condim": 6, "solref": [0.004, 1.0]}
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 0.1], **contact)
    body = spec.worldbody.add_body()
    body.add_freejoint()
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="hull", mass=0.0, **contact)
    body.explicitinertial = True
    body.mass = part.mass
    body.ipos = [0, 0, 0]
    inertia = _inertia(part)
    body.fullinertia = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return spec.compile()


def _inertia(part: GraspObject) -> FloatArray:
    """Inertia tensor (3, 3) about the center of mass, homogeneous [kg m^2]."""
    mesh = part.mesh.copy()
    mesh.density = part.mass / part.volume
    return np.asarray(mesh.moment_inertia)


def _pose_of(part: GraspObject, poses: tuple[StablePose, ...], down: FloatArray | None) -> int:
    """Index of the stable pose that a resting direction belongs to, -1 for none."""
    if down is None:
        return -1
    sym = symmetry(part)
    angles = [sym.equivalent_directions(-pose.T_world_object[2, :3], down) for pose in poses]
    best = int(np.argmin(angles))
    return best if angles[best] < SAME_POSE else -1


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--drops", type=int, default=300)
    arguments.add_argument("--height", type=float, default=0.01, help="of the lowest point [m]")
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("names", nargs="*", default=[])
    options = arguments.parse_args()
    print(f"{'part':18} poses  rank corr  top-1  misplaced  elsewhere  predicted / simulated %")
    results: list[Comparison] = []
    for name in options.names or OBJECT_NAMES:
        result = compare(load_object(name), options.drops, options.seed, options.height)
        results.append(result)
        print(f"{name:18} {_row(result)}", flush=True)
    several = [result for result in results if len(result.predicted) > 1]
    print(
        f"mean rank correlation {np.mean([r.rank_correlation for r in several]):.2f} over "
        f"{len(several)} parts with several poses; top-1 agrees on "
        f"{sum(r.top_agrees for r in results)} of {len(results)}; "
        f"misplaced {np.mean([r.total_variation for r in results]):.3f} on average"
    )


def _row(result: Comparison) -> str:
    shown: IntArray = np.arange(min(6, len(result.predicted)))
    pairs = " ".join(
        f"{100 * result.predicted[i]:.0f}/{100 * result.simulated[i]:.0f}" for i in shown
    )
    return (
        f"{len(result.predicted):5d} {result.rank_correlation:10.2f} {result.top_agrees!s:>6} "
        f"{result.total_variation:10.3f} {result.elsewhere:10.3f}  {pairs}"
    )


if __name__ == "__main__":
    main()
