"""Contact patches of a settled grasp, under the pressure of an elastic foundation."""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray, frozen
from reach.contact import ContactPatch
from reach.grasp import Grasp
from reach.kernels.compiling import announce_compilation
from reach.kernels.pads import pads_of
from reach.kernels.tree import mesh_tree
from reach.kernels.verdict import find_patch, make_workspace
from reach.scene import Scene
from reach.transforms import apply


def settled_patches(scene: Scene, grasp: Grasp, depths: FloatArray) -> tuple[ContactPatch, ...]:
    """Describe where and how hard each pad presses.

    Args:
        scene: part and gripper.
        grasp: the hand in the settled part.
        depths: how deep each pad is pressed in, shape (J,) [m]; zero without contact.
    """
    pads = pads_of(scene.gripper, grasp.opening)
    found = []
    for jaw, depth in enumerate(depths):
        T_object_pad = grasp.T_object_gripper @ pads.T_gripper_pad[jaw]
        if depth <= 0.0:
            continue
        announce_compilation(find_patch)
        count, high, space = find_patch(
            mesh_tree(scene.object), pads, jaw, T_object_pad, depth, make_workspace(1)
        )
        if count:
            found.append(
                _described(
                    jaw,
                    space.triangles[:count],
                    space.normals[:count],
                    high,
                    depth,
                    grasp.force,
                    T_object_pad,
                    scene.object.com,
                )
            )
    return tuple(found)


def _described(
    jaw: int,
    triangles_pad: FloatArray,
    normals_pad: FloatArray,
    high: float,
    depth: float,
    force: float,
    T_object_pad: FloatArray,
    com_object: FloatArray,
) -> ContactPatch:
    """One jaw's patch; arguments as for [describe_patch][reach.models.patches.describe_patch]."""
    sides = triangles_pad[:, 1:] - triangles_pad[:, :1]
    areas = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    delta = high - triangles_pad[..., 2]
    per_area = delta.mean(axis=1)
    stiffness = force / float((areas * per_area) @ normals_pad[:, 2])
    weighted = triangles_pad.sum(axis=1) * delta.sum(axis=1, keepdims=True)
    weighted += np.einsum("mi,mij->mj", delta, triangles_pad)
    moments = areas[:, None] / 12.0 * weighted  # integral of delta r over each triangle
    rotation = T_object_pad[:3, :3]
    force_object = stiffness * rotation @ ((areas * per_area) @ normals_pad)
    torque_pad = stiffness * np.cross(moments, normals_pad).sum(axis=0)
    center_pad = moments.sum(axis=0) / float(areas @ per_area)
    T_contact = np.array(T_object_pad)
    T_contact[:3, 3] += rotation[:, 2] * (high - depth)
    mean = rotation @ (areas @ normals_pad)
    arm = T_object_pad[:3, 3] - com_object
    return ContactPatch(
        jaw,
        frozen(apply(T_object_pad, triangles_pad.reshape(-1, 3)).reshape(-1, 3, 3)),
        frozen(stiffness * delta),
        float(areas.sum()),
        frozen(apply(T_object_pad, center_pad[None])[0]),
        frozen(mean / np.linalg.norm(mean)),
        frozen(force_object),
        frozen(rotation @ torque_pad + np.cross(arm, force_object)),
        frozen(T_contact),
    )
