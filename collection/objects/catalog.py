"""Which parts are built in, and where each is drawn.

Names are known without importing the geometry libraries, so that the command line stays quick.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class BuiltIn:
    """One built-in part.

    Args:
        module: in collection.objects, holding a function of the part's name.
        challenge: what makes it easy or hard to hold.
    """

    module: str
    challenge: str


CATALOG: dict[str, BuiltIn] = {
    "cube_3cm": BuiltIn("blocks", "easy: parallel faces everywhere"),
    "near_cube": BuiltIn("blocks", "easy to hold, hard to tell its sides apart"),
    "wedge": BuiltIn("blocks", "faces that squeeze out of the jaws"),
    "bracket": BuiltIn("blocks", "thin walls at an angle, off-center rib"),
    "perforated_plate": BuiltIn("blocks", "lies 4 mm low: only the tips reach it"),
    "star": BuiltIn("blocks", "edges and slants; turns in the jaws"),
    "hook": BuiltIn("blocks", "overhang, off-center mass"),
    "clamp": BuiltIn("blocks", "bars around a void, off-center mass"),
    "cylinder": BuiltIn("turned", "rolls; line contact"),
    "egg": BuiltIn("turned", "rolls; two curvatures, no flat face"),
    "pawn": BuiltIn("turned", "a ball, a waist and a foot: small contacts"),
    "vase": BuiltIn("turned", "bulges; slips off the belly"),
    "nozzle": BuiltIn("turned", "cone and hexagon; squeezes out"),
    "bowl": BuiltIn("turned", "wider than the jaws: held by its slanted wall"),
    "cup": BuiltIn("turned", "tapered thin wall, held across or by the rim"),
    "mug": BuiltIn("turned", "held across, by the rim or by the handle"),
    "knob": BuiltIn("machinery", "flutes: many small faces in one contact"),
    "gear": BuiltIn("machinery", "teeth: contact on edges"),
    "mount": BuiltIn("machinery", "flat sides, round head"),
    "pipe_connector": BuiltIn("machinery", "round in two directions, off-center mass"),
    "turbine": BuiltIn("machinery", "twisted blades, hardly a pair of opposite faces"),
}

OBJECT_NAMES: tuple[str, ...] = tuple(CATALOG)
