"""The simulated cell's section of the station file."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field, field_validator

from collection.cell.faults import FaultKind

Range = tuple[float, float]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ScriptedFault(_Section):
    """A fault and the attempt (counted from 1 by placements) it happens in."""

    kind: FaultKind
    attempt: int = Field(ge=1)


class SimulationSettings(_Section):
    """What the simulated cell draws in secret, once for each object.

    Attributes:
        friction: range of the friction between pads and object.
        table_friction: range of the friction between table and object.
        pad_modulus: range of the pads' Young's modulus [Pa].
        hand_offset: standard deviation of the hand's constant position error [m].
        hand_tilt: standard deviation of its constant rotation error [rad].
        repeatability: standard deviation of each motion's own position error [m].
        joint_noise: standard deviation of a joint reading [rad].
        width_noise: standard deviation of a width reading [m].
        force_noise: standard deviation of a force reading [N].
        force_error: standard deviation of the closing force, as a share of it.
        latency: time from a command to its effect [s].
        closing_speed: of each jaw [m/s].
        guarded_force: at which a guarded motion stops [N].
        hard_force: at which any motion stops [N].
        emergency_stop_time: until somebody releases the scripted emergency stop [s].
        timestep: of the physics [s].
        sample_period: between two readings of a moving robot [s].
        faults: scripted ones.
    """

    friction: Range = (0.3, 0.6)
    table_friction: Range = (0.25, 0.5)
    pad_modulus: Range = (0.4e6, 0.9e6)
    hand_offset: float = Field(default=0.5e-3, ge=0)
    hand_tilt: float = Field(default=2e-3, ge=0)
    repeatability: float = Field(default=0.1e-3, ge=0)
    joint_noise: float = Field(default=1e-4, ge=0)
    width_noise: float = Field(default=2e-5, ge=0)
    force_noise: float = Field(default=0.3, ge=0)
    force_error: float = Field(default=0.03, ge=0)
    latency: float = Field(default=0.02, ge=0)
    closing_speed: float = Field(default=0.02, gt=0)
    guarded_force: float = Field(default=12.0, gt=0)
    hard_force: float = Field(default=60.0, gt=0)
    emergency_stop_time: float = Field(default=5.0, ge=0)
    timestep: float = Field(default=4e-3, gt=0, le=5e-3)
    sample_period: float = Field(default=0.04, gt=0)
    faults: tuple[ScriptedFault, ...] = ()

    @field_validator("friction", "table_friction", "pad_modulus")
    @classmethod
    def _rising(cls, value: Range) -> Range:
        if not 0 < value[0] <= value[1]:
            raise ValueError(f"{list(value)} is not a range: expected 0 < lower <= upper")
        return value
