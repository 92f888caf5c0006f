"""A contact patch's pressure, beside the forces of the simulated world's pins: the paper's Fig. 2.

The two know nothing of each other: one is REACH's closed form on the mesh, the other the state of
a simulated hand that closed on the same object at the same pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from logs.report.charts import figure, to_svg
from reach.arrays import FloatArray
from reach.evaluation.cases import GraspCase
from reach.gripper import Pad
from reach.transforms import apply, inverse

if TYPE_CHECKING:
    from reach.contact import ContactPatch

CLOSING_TIME = 0.6
"""How long the simulated hand is given to close [s]."""
POINTS_PER_PATCH = 20000


@dataclass(frozen=True, slots=True, eq=False)
class PressureComparison:
    """One jaw's patch and pins.

    Args:
        pad: the pad.
        triangles: the patch in the pad's frame, shape (M, 3, 2) [m].
        pressures: at its corners, shape (M, 3) [Pa].
        pins: where the pins stand, pad frame, shape (P, 2) [m].
        pin_forces: shape (P,) [N].
        patch_forces: the patch's force on each pin's cell, shape (P,) [N].
        correlation: of the two forces over the pins; None if one of them is constant.
    """

    pad: Pad
    triangles: FloatArray
    pressures: FloatArray
    pins: FloatArray
    pin_forces: FloatArray
    patch_forces: FloatArray
    correlation: float | None


def compare_pressure(case: GraspCase, jaw: int = 0) -> PressureComparison | None:
    """Patch and pins of one jaw for a planned grasp; None if the pad does not touch."""
    from reach.models.area import AreaContact

    patches = AreaContact().evaluate(case.scene, case.grasp).patches
    patch = next((one for one in patches if one.jaw == jaw), None)
    if patch is None:
        return None
    T_pad_object = inverse(patch.T_object_pad)
    flat = apply(T_pad_object, patch.triangles_object.reshape(-1, 3)).reshape(-1, 3, 3)[..., :2]
    pins, forces = _pin_forces(case, jaw)
    on_pins = _forces_on_pins(patch, flat, pins)
    varied = np.ptp(forces) > 0 and np.ptp(on_pins) > 0
    correlation = float(np.corrcoef(forces, on_pins)[0, 1]) if varied else None
    pad = case.scene.gripper.jaws[jaw].pad
    return PressureComparison(pad, flat, patch.pressures, pins, forces, on_pins, correlation)


def pressure_svg(found: PressureComparison, name: str = "pressure") -> str:
    """The two pictures side by side, in the pad's frame, millimeters."""
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Polygon

    outline = found.pad.polygon[:, ::-1] * 1e3
    with figure((6.6, 3.6), panels=2) as (canvas, (left, right)):
        for axes, title in ((left, "REACH: pressure [kPa]"), (right, "simulated pins: force [N]")):
            axes.add_patch(Polygon(outline, closed=True, fill=False, edgecolor="#64748b", lw=1))
            axes.set(aspect="equal", title=title, xlabel="pad y [mm]")
            axes.set_xlim(outline[:, 0].min() - 2, outline[:, 0].max() + 2)
            axes.set_ylim(outline[:, 1].min() - 2, outline[:, 1].max() + 2)
            axes.title.set_fontsize(10)
        left.set_ylabel("pad x, toward the tip [mm]")
        triangles, pressures = _refined(found.triangles, found.pressures)
        shades = PolyCollection(
            list(triangles[..., ::-1] * 1e3),
            array=pressures / 1e3,
            cmap="viridis",
            edgecolor="face",
            lw=0.2,
            rasterized=True,  # thousands of shades: a picture inside the chart is smaller
        )
        left.add_collection(shades)
        shades.set_clim(0, None)
        canvas.colorbar(shades, ax=left, shrink=0.75)
        dots = right.scatter(
            found.pins[:, 1] * 1e3,
            found.pins[:, 0] * 1e3,
            c=found.pin_forces,
            s=120,
            cmap="viridis",
            vmin=0,
            edgecolors="#64748b",
            linewidths=0.4,
        )
        canvas.colorbar(dots, ax=right, shrink=0.75)
        return to_svg(canvas, name)


def _pin_forces(case: GraspCase, jaw: int) -> tuple[FloatArray, FloatArray]:
    """Close a simulated hand on the object and read the pins' springs."""
    from reach.world.grasp_world import GraspWorld
    from reach.world.pads import pin_bed
    from reach.world.parameters import WorldParameters

    scene = case.scene
    world = GraspWorld(
        scene.object,
        scene.gripper,
        scene.T_world_object,
        scene.T_world_object @ case.grasp.T_object_gripper,
        WorldParameters(),
        scene.table_height,
    )
    world.set_jaw_force(case.grasp.force)
    world.advance(CLOSING_TIME)
    return pin_bed(scene.gripper.jaws[jaw].pad).centers, np.maximum(world.pin_forces[jaw], 0.0)


def _forces_on_pins(patch: ContactPatch, flat: FloatArray, pins: FloatArray) -> FloatArray:
    """The patch's normal force, given to the nearest pin, shape (P,) [N]."""
    from scipy.spatial import cKDTree

    t = patch.triangles_object
    area = 0.5 * np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1)
    share = np.maximum((POINTS_PER_PATCH * area / area.sum()).astype(int), 1)
    triangle = np.repeat(np.arange(len(t)), share)
    u, v = np.random.default_rng(0).uniform(size=(2, len(triangle)))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    weights = np.stack([1 - u - v, u, v], axis=1)
    places = np.einsum("nk,nkj->nj", weights, flat[triangle])
    pressure = np.einsum("nk,nk->n", weights, patch.pressures[triangle])
    _, nearest = cKDTree(pins).query(places)
    forces = pressure * area[triangle] / share[triangle]
    return np.bincount(nearest, forces, len(pins)).astype(float)


def _refined(triangles: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cut triangles in four until colors, one a triangle, look smooth."""
    while len(triangles) < 3000:
        a, b, c = np.moveaxis(triangles, 1, 0)
        ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        x, y, z = values.T
        xy, yz, zx = 0.5 * (x + y), 0.5 * (y + z), 0.5 * (z + x)
        corners = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        numbers = [(x, xy, zx), (xy, y, yz), (zx, yz, z), (xy, yz, zx)]
        triangles = np.concatenate([np.stack(t, axis=1) for t in corners])
        values = np.concatenate([np.stack(v, axis=1) for v in numbers])
    return triangles, values.mean(axis=1)
