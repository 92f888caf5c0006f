"""What the simulated cell draws in secret for each object; no model is told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collection.cell.settings import SimulationSettings
from reach.arrays import FloatArray
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.transforms import exp, make_transform
from reach.world.parameters import WorldParameters


@dataclass(frozen=True, slots=True, eq=False)
class HiddenDraws:
    """What was drawn in secret for one object.

    Args:
        world: contact parameters.
        T_gripper_error: constant error of the hand's true pose, in the gripper's frame.
        force_factor: true over commanded closing force.
    """

    world: WorldParameters
    T_gripper_error: FloatArray
    force_factor: float


def draw_hidden(
    settings: SimulationSettings, obj: GraspObject, gripper: ParallelJawGripper, seed: int
) -> HiddenDraws:
    """Draw for one object: the same in every session with this seed."""
    rng = np.random.default_rng([seed, int(obj.content_hash[:12], 16)])
    world = WorldParameters(
        friction=float(rng.uniform(*settings.friction)),
        table_friction=float(rng.uniform(*settings.table_friction)),
        pad_modulus=float(rng.uniform(*settings.pad_modulus)),
        closing_speed=settings.closing_speed,
        timestep=settings.timestep,
    )
    tilt = rng.normal(0.0, settings.hand_tilt, 3)
    offset = rng.normal(0.0, settings.hand_offset, 3)
    factor = 1.0 + float(rng.normal(0.0, settings.force_error))
    # the error turns about the pads, not about the wrist: a calibrated hand is right there
    pads = np.mean([j.T_gripper_pad_open[:3, 3] for j in gripper.jaws], axis=0)
    about_pads = exp(np.concatenate([tilt, np.zeros(3)]))
    about_pads = make_transform(about_pads[:3, :3], pads - about_pads[:3, :3] @ pads + offset)
    return HiddenDraws(world, about_pads, max(0.5, factor))
