"""A made-up data set of any size, for tests that need one without running a session."""

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh

from logs.dataset.dataset import Dataset, StatedPoseError
from logs.dataset.labeled_trial import Execution, Label, LabeledTrial, LeftOut, StoredScore
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.transforms import exp, make_transform, rotation_about


def part(index, faces=1):
    """A box or, for a larger number of faces, an icosphere, on the table."""
    if faces <= 12:
        mesh = trimesh.creation.box((0.03, 0.02 + 0.001 * index, 0.025))
    else:
        mesh = trimesh.creation.icosphere(subdivisions=3, radius=0.015 + 0.0005 * index)
    return GraspObject(f"part {index}", mesh.vertices, mesh.faces, mass=0.01 + 0.001 * index)


def grasp_pose(rng):
    """Gripper above the object, fingers down, jaws closing along a random horizontal line."""
    down = rotation_about((1, 0, 0), np.pi)
    yaw = rotation_about((0, 0, 1), rng.uniform(-np.pi, np.pi))
    offset = rng.uniform(-0.004, 0.004, 3)
    rotation = yaw @ down
    return make_transform(rotation, offset - rotation @ (0, 0, 0.155))


def build_dataset(objects=3, grasps=4, repeats=2, seed=0, faces=12, simulated=True):
    """Trials with every column filled somewhere and missing somewhere."""
    rng = np.random.default_rng(seed)
    parts = {(one := part(i, faces)).name: one for i in range(objects)}
    trials = []
    for name, one in parts.items():
        height = -one.vertices[:, 2].min()
        for g in range(grasps):
            T_object_gripper, rate = grasp_pose(rng), rng.uniform()
            for r in range(repeats):
                number = len(trials)
                lifted = bool(rng.uniform() < rate)
                T_world_object = make_transform(None, (0.4, 0.1, height))
                registered = T_world_object @ exp(rng.normal(0, 1e-3, 6))
                trials.append(
                    LabeledTrial(
                        trial_id=f"trial-{number:05d}",
                        session="made-up",
                        number=number,
                        object_name=name,
                        grasp_id=f"{name}/g{g}",
                        attempt=g,
                        repeat=r,
                        stable_pose=g % 2,
                        T_world_object=T_world_object,
                        T_object_gripper=T_object_gripper,
                        table_height=0.0,
                        opening=None if g % 2 else 0.045,
                        force=20.0,
                        label=Label(
                            lifted,
                            rotated=lifted and r == 0,
                            reason=None if lifted else "slipped_on_lift",
                            operator="auto",
                            source="operator_sim",
                            note='said "no", then\nyes' if number == 1 else "",
                            time_ns=1_700_000_000_000_000_000 + number,
                            relabeled=int(number == 2),
                        ),
                        execution=Execution(
                            T_world_object=registered,
                            covariance=np.diag(
                                [np.pi**2 / 3 if number == 1 else 1e-6] + [1e-6] * 5
                            ),
                            covariance_in_hand=None if number == 6 else np.eye(6) * 2e-6,
                            T_world_gripper=registered @ T_object_gripper,
                            T_object_gripper=T_object_gripper,
                            jaw_width=0.021 if lifted else None,
                            jaw_force=19.5,
                            translation_error=1e-4 * number,
                            rotation_error=1e-3,
                            sensor_verdict="held" if lifted else "empty",
                            time_ns=1_700_000_000_000_000_000 + 10 * number,
                        )
                        if number % 5
                        else Execution(),
                        scores={
                            "reach": StoredScore(
                                float(rng.uniform()), "1", {"friction": 0.5, "saturate": True}
                            ),
                            **({"point": StoredScore(0.5, "2")} if number % 3 else {}),
                        },
                        takes=1 + (number == 3),
                        redos=("placement",) if number == 3 else (),
                        redo_outcomes=("lifted",) if number == 3 else (),
                        voids=("no pose found",) if number == 4 else (),
                        record=f"trials/{number:04d}/trial.mcap",
                        record_sha256="0" * 64,
                        simulated=simulated,
                        segment=int(number > 5),
                    )
                )
    return Dataset(
        name="made-up",
        origin="Made up for a test.",
        objects=parts,
        mass_sources=dict.fromkeys(parts, "made up"),
        gripper=ParallelJawGripper.yumi(),
        trials=tuple(trials),
        left_out=(LeftOut("t-x", "made-up", 99, "part 0", "part 0/g0", "executed, not labeled"),),
        pose_error=StatedPoseError(1e-3, 3e-3, "made up"),
    )


@pytest.fixture(name="make_dataset", scope="session")
def _make_dataset():
    return build_dataset


@pytest.fixture(scope="session")
def published():
    """The published physical trials of one object, and its mesh; not part of the project."""
    root = Path(os.environ.get("REACH_PUBLISHED", Path(__file__).parents[4] / "shared" / "data"))
    if (root / "reach2019" / "cube_3cm.json").is_file():
        return root
    pytest.skip("the published trials (reach2019/cube_3cm.json) are not on this machine")
