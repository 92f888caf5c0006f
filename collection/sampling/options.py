"""What the sampling of grasps can be told."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class SamplingOptions(BaseModel):
    """Limits of the search; lengths in meters, angles in radians."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    normal_angle: Annotated[float, Field(gt=0, le=1.2)] = 0.35
    """Largest angle between the closing axis and either contact's normal, 20 degrees."""
    approach_angle: Annotated[float, Field(gt=0, lt=1.5)] = 1.0471975511965976
    """Largest angle between the approach and straight down, 60 degrees."""
    jitter: NotNegative | None = None
    """Width of the cube about the grasp's center that jitter fills; the pad's width if None."""
    opening_margin: NotNegative = 1e-3
    """Room that each open jaw keeps to a contact along the closing axis."""
    min_width: Positive = 5e-4
    """Thinner walls are not planned on: the jaws could not tell them from nothing."""
    table_clearance: NotNegative = 1e-3
    """Least height of the open gripper over the table."""
    tip_margin: NotNegative = 1e-3
    """How far from the pad's tip the contacts of a low part stay when the hand is drawn back."""
    approach_distance: NotNegative = 0.075
    """Length of the straight way to the grasp, which must be free as well."""
    min_distance: Positive = 3e-3
    """Least distance of two kept grasps, see collection.sampling.distance."""
    batch: Annotated[int, Field(ge=1)] = 2000
    """Rays cast at once."""
    max_candidates: Annotated[int, Field(ge=1)] = 60_000
    """Rays after which the search gives up."""
