"""Shared by the tests of registration: the benchmark's parts and synthetic cameras."""

import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from reach import GraspObject
from reach.symmetry import pose_distance, symmetry

# The benchmarks are not installed with the packages.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks import registration_objects, registration_scenes  # noqa: E402


@pytest.fixture(scope="session")
def scenes() -> ModuleType:
    return registration_scenes


@pytest.fixture(scope="session")
def parts() -> dict[str, GraspObject]:
    return {name: registration_objects.part(name) for name in registration_objects.PARTS}


@pytest.fixture
def is_right():
    """Whether a pose is right by the benchmark's strict measure."""

    def check(case, T_camera_object) -> bool:
        from registration.mesh_model import mesh_model

        stereo = case.frame.sensor == "stereo"
        apart = mesh_model(case.obj).surface_distance(T_camera_object, case.T_camera_object)
        turn, shift = pose_distance(symmetry(case.obj), T_camera_object, case.T_camera_object)
        return bool(
            apart < (4e-3 if stereo else 2e-3)
            and turn < np.radians(5)
            and shift < (3e-3 if stereo else 2e-3)
        )

    return check
