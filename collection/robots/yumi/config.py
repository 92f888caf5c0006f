"""The robot's section of a station file when the driver is `yumi`."""

from __future__ import annotations

import os
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, PositiveFloat, SecretStr

PASSWORD_VARIABLE = "REACH_YUMI_PASSWORD"
DELIVERED = "robotics"
"""The password that every IRC5 is delivered with, as its manual prints it."""


def _password() -> SecretStr:
    return SecretStr(os.environ.get(PASSWORD_VARIABLE, DELIVERED))


class YumiConfig(BaseModel):
    """A real YuMi on an IRC5 controller (RobotWare 6, Robot Web Services 1.0).

    Lengths in meters, times in seconds.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    driver: Literal["yumi"]
    address: str = Field("192.168.125.1", description="host, or host:port, of the controller")
    user: str = Field("Default User", description="of the controller's user management")
    password: SecretStr = Field(
        default_factory=_password,
        description=f"of that user; without it the environment variable {PASSWORD_VARIABLE}",
    )
    side: Literal["right", "left"] = Field("right", description="arm that carries the gripper")
    base: tuple[float, float, float] = Field(
        (0.0, 0.0, 0.0), description="x, y, z of the robot's base in the world"
    )
    base_yaw: float = Field(0.0, description="turn of the robot about the vertical [rad]")
    guarded_percent: float = Field(
        50.0, ge=1, le=300, description="motion supervision while approaching, against the normal"
    )
    poll_interval: PositiveFloat = Field(0.05, description="between two looks at the program")
    request_timeout: PositiveFloat = Field(3.0, description="of one request to the controller")
    settle_time: PositiveFloat = Field(1.0, description="until readings must follow a motion")

    @property
    def url(self) -> str:
        """Root of the controller's web services."""
        return f"http://{self.address}"

    @property
    def task(self) -> str:
        """RAPID task of the arm."""
        return "T_ROB_R" if self.side == "right" else "T_ROB_L"

    @property
    def mechanical_unit(self) -> str:
        """The controller's name of the arm."""
        return "ROB_R" if self.side == "right" else "ROB_L"
