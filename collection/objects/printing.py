"""What a part weighs when it is printed: walls are solid, the inside is mostly air."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray, IntArray, positive
from reach.errors import InvalidInputError
from reach.objects import PLA_DENSITY, volume_and_centroid


@dataclass(frozen=True, slots=True)
class PrintSettings:
    """How a part is printed.

    The defaults are a light print, like the laboratory's: its 30 mm cube weighed 3.0 g, this
    model says 4.2 g.

    Args:
        wall: thickness of the solid shell [m]; one line of a 0.4 mm nozzle.
        infill: share of the inside that is filled.
        density: of the filament [kg/m^3].

    Raises:
        InvalidInputError: a value that no print has.
    """

    wall: float = 4e-4
    infill: float = 0.05
    density: float = PLA_DENSITY

    def __post_init__(self) -> None:
        positive(self.wall, "wall [m]")
        positive(self.density, "density [kg/m^3]")
        if not 0.0 <= self.infill <= 1.0:
            raise InvalidInputError(f"infill is {self.infill!r}, expected 0 to 1")


LIGHT_PRINT = PrintSettings()


def printed_mass(
    vertices: FloatArray, faces: IntArray, settings: PrintSettings = LIGHT_PRINT
) -> float:
    """Mass of a printed part [kg].

    The shell is taken as area times wall, at most the whole volume; exact for flat parts that
    are thick against the wall.
    """
    volume = abs(volume_and_centroid(vertices, faces)[0])
    t = vertices[faces]
    area = np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1).sum() / 2
    shell = min(volume, float(area) * settings.wall)
    return settings.density * (shell + settings.infill * (volume - shell))
