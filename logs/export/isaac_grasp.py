"""isaac_grasp YAML 1.0: one file an object; confidence is the grasp's success rate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from logs.dataset.dataset import Dataset
from logs.export.grasps import GraspSummary
from logs.export.names import safe_name
from reach.gripper import ParallelJawGripper
from reach.transforms import quat_wxyz_from_rotation


def isaac_files(
    dataset: Dataset, grasps: Mapping[str, list[GraspSummary]], stems: Mapping[str, str]
) -> dict[str, bytes]:
    """Files by path; poses are those of the gripper in the object's frame."""
    import yaml

    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    files = {}
    for name, rows in grasps.items():
        marked = "simulated" if any(row.simulated for row in rows) else "physical"
        content = {
            "format": "isaac_grasp",
            "format_version": 1.0,
            "object_frame": safe_name(name),
            "gripper_frame": f"{dataset.gripper.name}_base",
            "grasps": {f"grasp_{i}": _grasp(row, dataset.gripper) for i, row in enumerate(rows)},
        }
        head = (
            f"# {marked} trials of {name} with the {dataset.gripper.name} hand; confidence = share "
            "of trials stably lifted.\n# Meters; cspace positions are each jaw's distance from "
            "closed, left out where no width is known; gripper z toward the finger tips, jaws close along x.\n"
        )
        text = yaml.dump(content, Dumper=dumper, sort_keys=False, default_flow_style=None)
        files[f"isaac_grasp/{stems[name]}.yaml"] = (head + text).encode()
    return files


def _grasp(row: GraspSummary, gripper: ParallelJawGripper) -> dict[str, Any]:
    w, x, y, z = quat_wxyz_from_rotation(row.T_object_gripper[:3, :3]).tolist()
    # Never zero for "not known": that would say that the jaws met.
    closed = {} if row.width is None else {"cspace_position": _jaws(gripper, 0.5 * row.width)}
    return {
        "confidence": row.rate,
        "position": row.T_object_gripper[:3, 3].tolist(),
        "orientation": {"w": w, "xyz": [x, y, z]},
        **closed,
        "pregrasp_cspace_position": _jaws(gripper, gripper.stroke),
    }


def _jaws(gripper: ParallelJawGripper, distance: float) -> dict[str, float]:
    return {f"jaw_{i}": distance for i in range(len(gripper.jaws))}
