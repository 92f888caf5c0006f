"""The station file: which robot, which camera, where things stand; and the station it describes."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, InstanceOf

from collection.cell.settings import SimulationSettings
from collection.clock import Clock, SimulatedClock, WallClock
from collection.errors import CalibrationError
from collection.robots.motion_settings import MotionSettings
from collection.station.drivers import (
    CAMERA_DRIVERS,
    ROBOT_DRIVERS,
    BuildContext,
    find_driver,
)
from collection.station.file import (
    Sections,
    read_sections,
    station_text,
    validated,
    without_secrets,
)
from reach.errors import UnknownNameError

if TYPE_CHECKING:
    from collection.cameras.protocol import ColorCamera, DepthCamera
    from collection.cell.simulation import Simulation, Workspace
    from collection.robots.protocol import Arm, GripperDevice
    from reach.gripper import ParallelJawGripper
    from reach.pose_error import PoseError

PACKAGED = Path(__file__).parent
GRIPPERS = ("yumi",)
SIMULATED = "simulated"
"""Name of the simulated drivers of robot and camera."""


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class WorkspaceConfig(_Section):
    """Where objects are placed.

    Attributes:
        center: world x, y [m].
        size: extents along x and y [m].
        table_height: world z of the table [m].
    """

    center: tuple[float, float] = (0.38, -0.10)
    size: tuple[float, float] = (0.08, 0.08)
    table_height: float = 0.0


class GripperConfig(_Section):
    """The hand's shape, by name."""

    geometry: str = "yumi"


class PoseErrorConfig(_Section):
    """What the station knows of its own errors, beside each registration's own: measured once.

    A real station that states none has its calibration's residuals, or nothing: no number is made
    up for it. All are standard deviations of one coordinate or angle, at the workspace.

    Attributes:
        calibration_translation: of camera against robot [m].
        calibration_rotation: [rad].
        actuation_translation: of the gripper against its commanded pose [m].
        actuation_rotation: [rad].
        source: who says so; `unknown` leaves these errors out.
    """

    calibration_translation: float = Field(default=8e-4, ge=0)
    calibration_rotation: float = Field(default=1e-3, ge=0)
    actuation_translation: float = Field(default=5e-4, ge=0)
    actuation_rotation: float = Field(default=2e-3, ge=0)
    source: Literal["stated", "calibration", "unknown"] = "stated"

    def total(self) -> PoseError:
        """Calibration and actuation together, as an error of the object's pose."""
        from reach.pose_error import PoseError

        calibration = PoseError.isotropic(
            translation=self.calibration_translation, rotation=self.calibration_rotation
        )
        return calibration + PoseError.isotropic(
            translation=self.actuation_translation, rotation=self.actuation_rotation
        )


class StationConfig(_Section):
    """A validated station file.

    Attributes:
        name: of the station.
        workspace: where objects are placed.
        gripper: the hand's shape.
        motion: numbers of the trial motion.
        pose_error: of calibration and actuation, as the models are told.
        robot: the robot driver's own section.
        camera: the camera driver's own section.
        simulation: hidden draws and faults, for simulated stations only.
    """

    name: str
    workspace: WorkspaceConfig = WorkspaceConfig()
    gripper: GripperConfig = GripperConfig()
    motion: MotionSettings = MotionSettings()
    pose_error: PoseErrorConfig = PoseErrorConfig()
    robot: InstanceOf[BaseModel]
    camera: InstanceOf[BaseModel]
    simulation: SimulationSettings | None = None

    def gripper_geometry(self) -> ParallelJawGripper:
        """The hand's pads, stroke and solids.

        Raises:
            UnknownNameError: no gripper of that name.
        """
        from reach.gripper import ParallelJawGripper

        if self.gripper.geometry not in GRIPPERS:
            raise UnknownNameError("gripper", self.gripper.geometry, GRIPPERS)
        return ParallelJawGripper.yumi()

    def workspace_area(self) -> Workspace:
        """The workspace as the simulated cell needs it."""
        from collection.cell.simulation import Workspace

        return Workspace(self.workspace.center, self.workspace.size, self.workspace.table_height)


@dataclass(slots=True, eq=False)
class Station:
    """A station's devices, inert until connected; a context manager that connects them all.

    Args:
        config: the validated station file.
        text: the station file as it was read, for the record, but for its secrets.
        arm: the arm.
        gripper: the hand.
        camera: finds the object.
        color_camera: films the trial, if there is one.
        clock: of the station.
        simulation: the simulated cell, for simulated stations only.
    """

    config: StationConfig
    text: str
    arm: Arm
    gripper: GripperDevice
    camera: DepthCamera
    color_camera: ColorCamera | None
    clock: Clock
    simulation: Simulation | None
    _stack: ExitStack | None = None

    @property
    def simulated(self) -> bool:
        """Whether the robot is a simulated one."""
        return self.simulation is not None

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            devices = (self.arm, self.gripper, self.camera, self.color_camera)
            for device in devices:
                if device is not None:
                    stack.enter_context(device)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *exception: object) -> None:
        if self._stack is not None:
            self._stack.close()
            self._stack = None


def station_names() -> tuple[str, ...]:
    """Names of the stations that come with the package."""
    return tuple(sorted(path.stem for path in PACKAGED.glob("*.toml")))


def find_station_file(name_or_path: str | Path) -> Path:
    """Path of a station file.

    Raises:
        UnknownNameError: neither a packaged station nor a file.
    """
    path = Path(name_or_path)
    if path.is_file():
        return path
    if str(name_or_path) in station_names():
        return PACKAGED / f"{name_or_path}.toml"
    raise UnknownNameError("station (no file, and no packaged one)", str(path), station_names())


def read_station(name_or_path: str | Path) -> StationConfig:
    """Read and validate a station file.

    Raises:
        StationFileError: with the line, and the valid keys or values.
        UnknownNameError: there is no such station.
    """
    path = find_station_file(name_or_path)
    return parse_station(station_text(path), path.name)


def parse_station(text: str, name: str) -> StationConfig:
    """Validate a station file's text; `name` is for the error message.

    Raises:
        StationFileError: with the line, and the valid keys or values.
    """
    sections = read_sections(text, name)
    data: dict[str, Any] = dict(sections.data)
    for section, drivers in (("robot", ROBOT_DRIVERS), ("camera", CAMERA_DRIVERS)):
        raw = data.get(section)
        if not isinstance(raw, dict) or not isinstance(raw.get("driver"), str):
            raise sections.error(
                (section,),
                f"[{section}] needs a driver; valid: {', '.join(sorted(drivers))}",
            )
        try:
            driver = find_driver(section, drivers, raw["driver"])
        except UnknownNameError as error:
            raise sections.error((section, "driver"), str(error)) from error
        data[section] = validated(driver.config_model(), raw, sections, (section,))
    config = validated(StationConfig, data, sections, ())
    assert isinstance(config, StationConfig)
    _refuse_half_simulated(config, sections)
    _refuse_too_strong_a_grip(config, sections)
    return config


def load_station(name_or_path: str | Path, seed: int = 0) -> Station:
    """Build the devices of a station; nothing is connected yet.

    Args:
        name_or_path: a packaged station's name (`simulated`) or a station file.
        seed: of everything a simulated station draws.

    Raises:
        StationFileError: with the line, and the valid keys or values.
        UnknownNameError: there is no such station.
    """
    path = find_station_file(name_or_path)
    text = station_text(path)
    return build_station(parse_station(text, path.name), text, path.parent, seed)


def build_station(config: StationConfig, text: str, folder: Path, seed: int) -> Station:
    """Build the devices of a validated station file."""
    simulated = _driver(config.robot) == SIMULATED
    clock: Clock = SimulatedClock() if simulated else WallClock()
    context = BuildContext(config, clock, seed, folder)
    robot = ROBOT_DRIVERS[_driver(config.robot)]
    camera = CAMERA_DRIVERS[_driver(config.camera)]
    arm, gripper = robot.make(config.robot, context)
    depth_camera = camera.make(config.camera, context)
    config = config.model_copy(update={"pose_error": _known_pose_error(config, depth_camera)})
    return Station(
        config=config,
        text=without_secrets(text, config.robot, config.camera),
        arm=arm,
        gripper=gripper,
        camera=depth_camera,
        color_camera=context.shared.get("color_camera"),
        clock=clock,
        simulation=context.shared.get("simulation"),
    )


def _known_pose_error(config: StationConfig, camera: DepthCamera) -> PoseErrorConfig:
    """What is known of a station's errors: as stated, else the calibration's residuals, else none."""
    from collection.calibration.calibration import calibration_of

    if "pose_error" in config.model_fields_set or config.simulation is not None:
        return config.pose_error
    try:
        calibration = calibration_of(camera)
    except CalibrationError:
        calibration = None  # the camera says so where it matters
    return PoseErrorConfig(
        calibration_translation=calibration.translation_rms if calibration else 0.0,
        calibration_rotation=calibration.rotation_rms if calibration else 0.0,
        actuation_translation=0.0,
        actuation_rotation=0.0,
        source="unknown" if calibration is None else "calibration",
    )


def _driver(section: BaseModel) -> str:
    return str(section.driver)  # type: ignore[attr-defined]


def _refuse_half_simulated(config: StationConfig, sections: Sections) -> None:
    """Real devices need the wall's clock, simulated ones their own: there is one for all."""
    robot, camera = _driver(config.robot), _driver(config.camera)
    if (robot == SIMULATED) != (camera == SIMULATED):
        raise sections.error(
            ("camera", "driver"),
            f"robot {robot!r} with camera {camera!r}: a station is simulated as a whole or not at all",
        )
    if robot == SIMULATED and config.simulation is None:
        raise sections.error((), "a simulated station needs the section [simulation]")
    if robot != SIMULATED and config.simulation is not None:
        raise sections.error(
            ("simulation",), f"[simulation] in a station with a real robot ({robot}): remove it"
        )


def _refuse_too_strong_a_grip(config: StationConfig, sections: Sections) -> None:
    try:
        hand = config.gripper_geometry()
    except UnknownNameError as error:
        raise sections.error(("gripper", "geometry"), str(error)) from error
    if config.motion.closing_force > hand.max_force:
        raise sections.error(
            ("motion", "closing_force"),
            f"closing_force {config.motion.closing_force:g} N is more than the hand's"
            f" {hand.max_force:g} N",
        )
