"""Which drivers a station file may name, and how each is built.

A driver is two names, imported only when a station uses it: a pydantic model of its section in
the station file, and a `build(config, context)` function.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reach.errors import UnknownNameError

if TYPE_CHECKING:
    from pydantic import BaseModel

    from collection.clock import Clock


@dataclass(frozen=True, slots=True)
class Driver:
    """Where a driver lives, each as `module:name`."""

    config: str
    build: str

    def config_model(self) -> type[BaseModel]:
        """The pydantic model of the driver's section in the station file."""
        model: type[BaseModel] = _resolve(self.config)
        return model

    def make(self, config: BaseModel, context: BuildContext) -> Any:
        """Build the device: `build(config, context)`; inert until it is connected."""
        return _resolve(self.build)(config, context)


@dataclass(frozen=True, slots=True)
class BuildContext:
    """What a driver's `build` gets besides its own section.

    Args:
        station: the whole station file (a `StationConfig`).
        clock: of the station.
        seed: of this run; simulated devices draw everything from it.
        folder: relative paths in the station file start here.
        shared: devices that belong together meet here (the simulated cell).
    """

    station: Any
    clock: Clock
    seed: int
    folder: Path
    shared: dict[str, Any] = field(default_factory=dict)


# A robot's `build` returns (Arm, GripperDevice); a camera's returns a DepthCamera.
ROBOT_DRIVERS: Mapping[str, Driver] = {
    "simulated": Driver(
        "collection.robots.simulated_config:SimulatedRobotConfig",
        "collection.robots.simulated:build",
    ),
    "yumi": Driver("collection.robots.yumi.config:YumiConfig", "collection.robots.yumi:build"),
}
CAMERA_DRIVERS: Mapping[str, Driver] = {
    "simulated": Driver(
        "collection.cameras.simulated_config:SimulatedCameraConfig",
        "collection.cameras.simulated:build",
    ),
    "folder": Driver(
        "collection.cameras.folder:FolderCameraConfig", "collection.cameras.folder:build"
    ),
    "realsense": Driver(
        "collection.cameras.realsense:RealSenseConfig", "collection.cameras.realsense:build"
    ),
}


def find_driver(kind: str, drivers: Mapping[str, Driver], name: str) -> Driver:
    """Look a driver up by the name a station file gives.

    Raises:
        UnknownNameError: no such driver; the message lists the valid ones.
    """
    if name not in drivers:
        raise UnknownNameError(f"{kind} driver", name, drivers)
    return drivers[name]


def _resolve(where: str) -> Any:
    module, _, attribute = where.partition(":")
    return getattr(importlib.import_module(module), attribute)
