"""The trial motion's numbers: the station file's section [motion]."""

from __future__ import annotations

from math import pi

from pydantic import BaseModel, ConfigDict, Field

from collection.robots.protocol import Speed


class MotionSettings(BaseModel):
    """Distances, speeds and times of the trial motion; the defaults are the laboratory's.

    Attributes:
        approach_distance: back along the approach axis, where the slow approach starts [m].
        lift_height: [m]; more than the 50 mm that count as lifted.
        hold_time: in the air [s]; at least the 1 s that counts as held.
        touch_distance: a contact this near the grasp ends the approach there; fingertips may
            meet the table where the registered pose errs by a millimeter [m].
        closing_force: [N].
        fast: speed of the transit [m/s].
        slow: speed of the approach and of putting the part down [m/s].
        lift_speed: [m/s].
        joint_share: largest share of the joints' maximal speed.
        avoidance_height: least height of the gripper's frame in the avoidance pose [m].
        held_width: jaws further apart than this hold something [m].
        held_force: a hand that presses less than this holds nothing [N].
        shake: whether to shake the part after the hold.
        shake_radius: distance of the pads from the axis that the shake turns about [m].
        shake_angle: to each side [rad].
        shake_cycles: how often.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    approach_distance: float = Field(default=0.075, gt=0, le=0.3)
    lift_height: float = Field(default=0.100, ge=0.06, le=0.4)
    hold_time: float = Field(default=1.0, ge=1.0, le=60)
    touch_distance: float = Field(default=0.003, ge=0, le=0.01)
    closing_force: float = Field(default=20.0, gt=0)
    fast: float = Field(default=0.35, gt=0, le=1.5)
    slow: float = Field(default=0.06, gt=0, le=0.5)
    lift_speed: float = Field(default=0.12, gt=0, le=1.0)
    joint_share: float = Field(default=0.5, gt=0, le=1)
    avoidance_height: float = Field(default=0.36, gt=0)
    held_width: float = Field(default=1e-4, ge=0)
    held_force: float = Field(default=2.0, ge=0)
    shake: bool = False
    shake_radius: float = Field(default=0.2, gt=0)
    shake_angle: float = Field(default=0.03 * pi, gt=0, lt=0.6)
    shake_cycles: int = Field(default=3, ge=1, le=50)

    def transit(self) -> Speed:
        """Speed of motions where nothing is near."""
        return Speed(self.fast, joint=self.joint_share)

    def careful(self) -> Speed:
        """Speed of the approach and of putting the part down."""
        return Speed(self.slow, angular=0.5, joint=self.joint_share)

    def lifting(self) -> Speed:
        """Speed of the lift."""
        return Speed(self.lift_speed, joint=self.joint_share)
