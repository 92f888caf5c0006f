"""ACRONYM's HDF5: one file an object, one entry each planned grasp with its majority label."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np

from logs.dataset.dataset import Dataset
from logs.export.grasps import GraspSummary
from reach.objects import GraspObject

MOTIONS = tuple(
    f"object_motion_during_{phase}_{kind}"
    for phase in ("closing", "shaking")
    for kind in ("linear", "angular")
)


def acronym_files(
    dataset: Dataset,
    grasps: Mapping[str, list[GraspSummary]],
    meshes: Mapping[str, str],
    stems: Mapping[str, str],
) -> dict[str, bytes]:
    """Files by path. What no trial measured (motions, friction) is NaN, never zero."""
    return {
        f"acronym/{stems[name]}.h5": _file(dataset, dataset.objects[name], rows, meshes[name])
        for name, rows in grasps.items()
    }


def _file(dataset: Dataset, part: GraspObject, rows: list[GraspSummary], mesh: str) -> bytes:
    import h5py

    stream = io.BytesIO()
    with h5py.File(stream, "w", libver="v110") as file:
        file.attrs["simulated"] = any(row.simulated for row in rows)
        _write_grasps(file, rows)
        _put(file, "gripper/type", dataset.gripper.name)
        _put(
            file,
            "gripper/configuration",
            np.full(len(dataset.gripper.jaws), dataset.gripper.stroke),
        )
        for key, value in _object_values(part, mesh).items():
            _put(file, f"object/{key}", value)
    return stream.getvalue()


def _write_grasps(file: Any, rows: list[GraspSummary]) -> None:
    _put(file, "grasps/transforms", np.array([row.T_object_gripper for row in rows]))
    flex = "grasps/qualities/flex/"
    _put(file, flex + "object_in_gripper", np.array([row.majority for row in rows], np.int8))
    for motion in MOTIONS:
        _put(file, flex + motion, np.full(len(rows), np.nan))
    trials = "grasps/qualities/trials/"
    _put(file, trials + "success_rate", np.array([row.rate for row in rows]))
    _put(file, trials + "successes", np.array([row.successes for row in rows], np.int64))
    _put(file, trials + "trials", np.array([row.trials for row in rows], np.int64))
    widths = [np.nan if row.width is None else row.width for row in rows]
    _put(file, "grasps/width", np.array(widths))


def _object_values(part: GraspObject, mesh: str) -> dict[str, Any]:
    solid = part.mesh.copy()
    solid.density = part.mass / part.volume
    return {
        "file": mesh,
        "scale": 1.0,
        "mass": part.mass,
        "density": part.mass / part.volume,
        "friction": np.nan,
        "volume": part.volume,
        "com": part.com,
        "inertia": np.asarray(solid.moment_inertia),
    }


def _put(file: Any, path: str, value: Any) -> None:
    """Write one value without the time of writing, so that the same data gives the same bytes."""
    file.create_dataset(path, data=value, track_times=False)
