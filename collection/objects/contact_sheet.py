"""One picture of many parts, with what is to be known of each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from collection.pictures import View, part_picture
from reach.objects import GraspObject
from reach.stable_poses import stable_poses

COLUMNS = 7
TILE = View(width=190, height=150)
_CAPTION = 30


def contact_sheet(parts: Sequence[GraspObject], columns: int = COLUMNS) -> Any:
    """A pillow image of parts in their likeliest stable poses, names and masses below."""
    from PIL import Image, ImageDraw

    rows = -(-len(parts) // columns)
    sheet = Image.new(
        "RGB", (min(columns, len(parts)) * TILE.width, rows * (TILE.height + _CAPTION)), "white"
    )
    pen = ImageDraw.Draw(sheet)
    for number, part in enumerate(parts):
        x = number % columns * TILE.width
        y = number // columns * (TILE.height + _CAPTION)
        pose = stable_poses(part, 0.0)[0]
        sheet.paste(Image.fromarray(part_picture(part, pose.T_world_object, TILE)), (x, y))
        pen.text((x + 6, y + TILE.height + 3), part.name, fill="black")
        caption = f"{len(part.faces)} faces, {part.mass * 1e3:.1f} g"
        pen.text((x + 6, y + TILE.height + 15), caption, fill="#555555")
    return sheet
