"""GraspGen's JSON: one file an object, one grasp each planned grasp with its majority label."""

from __future__ import annotations

import json
from collections.abc import Mapping

from logs.dataset.dataset import Dataset
from logs.export.grasps import GraspSummary


def graspgen_files(
    dataset: Dataset,
    grasps: Mapping[str, list[GraspSummary]],
    meshes: Mapping[str, str],
    stems: Mapping[str, str],
) -> dict[str, bytes]:
    """Files by path; each names its object's mesh relative to itself.

    Args:
        dataset: what is written.
        grasps: summaries by object.
        meshes: path of each object's mesh, relative to the data set's folder.
        stems: file stem of each object.
    """
    files = {}
    for name, rows in grasps.items():
        content = {
            "object": {"file": f"../{meshes[name]}", "scale": 1.0},
            "grasps": {
                "transforms": [row.T_object_gripper.tolist() for row in rows],
                "object_in_gripper": [row.majority for row in rows],
                "success_rate": [row.rate for row in rows],
                "trials": [row.trials for row in rows],
                "width": [row.width for row in rows],
                "id": [row.grasp_id for row in rows],
            },
            "gripper": {"name": dataset.gripper.name, "opening": dataset.gripper.max_opening},
            "simulated": any(row.simulated for row in rows),
        }
        files[f"graspgen/{stems[name]}.json"] = (json.dumps(content, indent=1) + "\n").encode()
    return files
