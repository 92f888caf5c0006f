"""What the grasp world assumes of materials, hand and time."""

from __future__ import annotations

from dataclasses import dataclass, fields

from reach.arrays import positive


@dataclass(frozen=True, slots=True)
class WorldParameters:
    """Contact and actuation parameters of the pin world.

    Args:
        friction: between pad and object.
        table_friction: between table and object.
        pad_modulus: Young's modulus of the pads' layer [Pa].
        pad_thickness: of that layer [m]; the pads' foundation modulus is modulus / thickness.
        closing_speed: of each jaw when nothing resists [m/s].
        finger_mass: of each jaw [kg].
        hand_mass: what moves with the wrist [kg]; heavier follows its target more stiffly.
        timestep: [s]; at 4 ms outcomes agree with those at 1 ms, docs/decisions/0031.
    """

    friction: float = 0.4
    table_friction: float = 0.4
    pad_modulus: float = 0.6e6
    pad_thickness: float = 4e-3
    closing_speed: float = 0.13
    finger_mass: float = 0.1
    hand_mass: float = 1.0
    timestep: float = 4e-3

    def __post_init__(self) -> None:
        for name in (each.name for each in fields(self)):
            positive(getattr(self, name), f"world parameter {name}")

    @property
    def foundation_modulus(self) -> float:
        """Pressure per depth of the pads [N/m^3]."""
        return self.pad_modulus / self.pad_thickness
