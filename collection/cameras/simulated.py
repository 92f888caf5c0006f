"""The simulated depth cameras, structured-light-like and stereo-like."""

from __future__ import annotations

from typing import Self

import numpy as np

from collection.cameras.cell_view import CellView
from collection.cameras.protocol import CameraState
from collection.cameras.sensor_noise import SENSOR_MODELS, spoil
from collection.cameras.simulated_color import SimulatedColorCamera
from collection.cameras.simulated_config import SimulatedCameraConfig
from collection.cell.faults import FaultKind
from collection.cell.shared import simulated_cell
from collection.cell.simulation import Simulation
from collection.errors import CameraNotConnectedError, CameraTimeoutError
from collection.station.drivers import BuildContext
from reach.arrays import FloatArray, frozen
from reach.transforms import exp, make_transform
from registration.frame import DepthFrame, Intrinsics

EXPOSURE = 0.1
"""Time a capture takes [s]."""


class SimulatedDepthCamera:
    """Looks at the simulated cell with a sensor's faults.

    What it reports as its pose is a calibration, which errs as a real one does.

    Args:
        config: kind and place of the sensor.
        simulation: the cell.
        seed: of the calibration error.
    """

    def __init__(self, config: SimulatedCameraConfig, simulation: Simulation, seed: int) -> None:
        self._config = config
        self._simulation = simulation
        self._model = SENSOR_MODELS[config.sensor]
        self._distance = float(np.linalg.norm(np.subtract(config.position, config.target)))
        self._intrinsics = _intrinsics(config, self._distance)
        T_true = looking_at(config.position, config.target)
        self._T_calibrated = frozen(T_true @ _calibration_error(config, seed))
        self._view = CellView(
            self._intrinsics,
            T_true,
            T_true[:3, 3] + T_true[:3, 0] * self._model.baseline,
            simulation.workspace.table_height,
        )
        self._connected = False

    @property
    def name(self) -> str:
        """Of the camera, for logs."""
        return f"simulated {self._config.sensor} camera"

    @property
    def intrinsics(self) -> Intrinsics:
        """Of the depth image."""
        return self._intrinsics

    def connect(self) -> None:
        """Switch the camera on."""
        self._connected = True

    def disconnect(self) -> None:
        """Switch the camera off."""
        self._connected = False

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(self, *exception: object) -> None:
        self.disconnect()

    def state(self) -> CameraState:
        """What the camera says of itself."""
        size = f"{self._intrinsics.width}x{self._intrinsics.height}"
        return CameraState(self._connected, f"{size} pixels")

    def capture(self) -> DepthFrame:
        """Take an image of the cell as it is now.

        Raises:
            CameraTimeoutError: scripted.
            CameraNotConnectedError: not connected.
        """
        if not self._connected:
            raise CameraNotConnectedError(f"the {self.name} is not connected: call connect()")
        simulation = self._simulation
        if simulation.fault_due(FaultKind.CAMERA_TIMEOUT):
            simulation.clock.sleep(self._config.timeout)
            raise CameraTimeoutError(f"no image within {self._config.timeout} s (scripted)")
        simulation.clock.sleep(EXPOSURE)
        obj = simulation.object
        pose = simulation.true_T_world_object() if obj is not None else None
        view = self._view.render(obj, pose)
        depth = spoil(
            view.depth,
            view.incidence,
            view.shadow,
            self._model,
            self._distance,
            simulation.noise,
        )
        return DepthFrame(
            depth=depth.astype(np.float32),
            intrinsics=self._intrinsics,
            T_world_camera=self._T_calibrated,
            color=view.color,
            time_ns=simulation.clock.now_ns(),
            sensor=self._config.sensor,
        )


def build(config: SimulatedCameraConfig, context: BuildContext) -> SimulatedDepthCamera:
    """Build the camera in the station's simulated cell, and the one that films it."""
    model = context.shared.get("arm_model")
    if config.video and model is not None:
        context.shared["color_camera"] = SimulatedColorCamera(simulated_cell(context), model)
    return SimulatedDepthCamera(config, simulated_cell(context), context.seed)


def looking_at(
    position: tuple[float, float, float], target: tuple[float, float, float]
) -> FloatArray:
    """T_world_camera of a camera that looks at a point, its image upright, shape (4, 4)."""
    ahead = np.subtract(target, position)
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    if np.linalg.norm(right) < 1e-9:  # straight down: the image's top is world x
        right = np.array([0.0, -1.0, 0.0])
    right = right / np.linalg.norm(right)
    return make_transform(np.column_stack([right, np.cross(ahead, right), ahead]), position)


def _intrinsics(config: SimulatedCameraConfig, distance: float) -> Intrinsics:
    model = SENSOR_MODELS[config.sensor]
    width, height = config.width or model.width, config.height or model.height
    focal = distance / model.pitch
    return Intrinsics(width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1))


def _calibration_error(config: SimulatedCameraConfig, seed: int) -> FloatArray:
    rng = np.random.default_rng([seed, 1])
    tilt = rng.normal(0.0, config.calibration_tilt, 3)
    offset = rng.normal(0.0, config.calibration_offset, 3)
    return exp(np.concatenate([tilt, offset]))
