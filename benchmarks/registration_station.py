"""Registration on the simulated station's own cameras: how far off, and what of it is calibration.

    python -m benchmarks.registration_station --poses 5 --seed 1

Every part stands in a random stable pose on the station's table, seen by its camera with a drawn
calibration error. Printed per part: the error of the center of mass and of the turn in the
camera's frame (registration's own) and in the world (with the calibration's).
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np

from collection.cameras.cell_view import CellView
from collection.cameras.sensor_noise import SENSOR_MODELS, spoil
from collection.cameras.simulated import looking_at
from collection.cameras.simulated_config import SimulatedCameraConfig
from collection.objects import OBJECT_NAMES, load_object
from reach import GraspObject
from reach.arrays import FloatArray
from reach.stable_poses import stable_poses
from reach.symmetry import pose_distance, symmetry
from reach.transforms import exp, inverse, make_transform, rotation_about
from registration import DepthFrame, Intrinsics, RegistrationError, register

SPREAD = 0.03
"""Parts stand within this of the point the camera looks at [m]."""


@dataclass(frozen=True)
class Errors:
    """Of one accepted registration: in the camera's frame and in the world ([rad, m] each)."""

    own: tuple[float, float]
    world: tuple[float, float]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--parts", default=",".join(OBJECT_NAMES))
    parser.add_argument("--poses", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sensors", default=",".join(SENSOR_MODELS))
    arguments = parser.parse_args()
    for sensor in arguments.sensors.split(","):
        print(f"{sensor}\n{'part':18s} asked refused wrong  own mm   deg  world mm   deg (medians)")
        everything: list[Errors] = []
        for number, name in enumerate(arguments.parts.split(",")):
            rng = np.random.default_rng([arguments.seed, number])
            everything += _part(load_object(name), sensor, arguments.poses, rng)
        print(f"{'all':18s} {'':19s} {_medians(everything)}", flush=True)


def _part(obj: GraspObject, sensor: str, count: int, rng: np.random.Generator) -> list[Errors]:
    asked = refused = wrong = 0
    errors: list[Errors] = []
    for k in range(count):
        frame, T_world_camera, T_world_object, pose = _capture(obj, sensor, rng)
        try:
            found = register(obj, frame, stable_pose=pose, seed=k)
        except RegistrationError:
            refused += 1
            continue
        if not found.accepted:
            asked += 1
            continue
        sym = symmetry(obj)
        own = pose_distance(sym, found.T_camera_object, inverse(T_world_camera) @ T_world_object)
        world = pose_distance(sym, found.T_world_object, T_world_object)
        errors.append(Errors(own, world))
        wrong += own[0] > np.radians(5) or own[1] > (3e-3 if sensor == "stereo" else 2e-3)
    print(f"{obj.name:18s} {asked:5d} {refused:7d} {wrong:5d} {_medians(errors)}", flush=True)
    return errors


def _medians(errors: list[Errors]) -> str:
    if not errors:
        return "      -     -         -     -"
    own = np.median([error.own for error in errors], axis=0)
    world = np.median([error.world for error in errors], axis=0)
    return (
        f"{1e3 * own[1]:7.3f} {np.degrees(own[0]):5.2f}   {1e3 * world[1]:7.3f} "
        f"{np.degrees(world[0]):5.2f}"
    )


def _capture(
    obj: GraspObject, sensor: str, rng: np.random.Generator
) -> tuple[DepthFrame, FloatArray, FloatArray, int]:
    """An image of the station's camera, its true pose, the part's, and the stable pose."""
    config = SimulatedCameraConfig(driver="simulated", sensor=sensor)  # type: ignore[arg-type]
    model = SENSOR_MODELS[sensor]
    distance = float(np.linalg.norm(np.subtract(config.position, config.target)))
    focal = distance / model.pitch
    size = (model.width, model.height)
    intrinsics = Intrinsics(*size, focal, focal, 0.5 * (size[0] - 1), 0.5 * (size[1] - 1))
    T_world_camera = looking_at(config.position, config.target)
    poses = stable_poses(obj)
    weights = np.sqrt([pose.probability for pose in poses])
    pose = int(rng.choice(len(poses), p=weights / weights.sum()))
    at = (*(np.array(config.target[:2]) + rng.uniform(-SPREAD, SPREAD, 2)), 0.0)
    turn = rotation_about((0, 0, 1), rng.uniform(0, 2 * np.pi))
    T_world_object = make_transform(turn, at) @ poses[pose].T_world_object
    second_eye = T_world_camera[:3, 3] + T_world_camera[:3, 0] * model.baseline
    view = CellView(intrinsics, T_world_camera, second_eye, 0.0).render(obj, T_world_object)
    depth = spoil(view.depth, view.incidence, view.shadow, model, distance, rng)
    error = exp(
        np.concatenate(
            [
                rng.normal(0.0, config.calibration_tilt, 3),
                rng.normal(0.0, config.calibration_offset, 3),
            ]
        )
    )
    frame = DepthFrame(depth.astype(np.float32), intrinsics, T_world_camera @ error, sensor=sensor)
    return frame, T_world_camera, T_world_object, pose


if __name__ == "__main__":
    main()
