"""Contact patches as values, from the compiled clipping."""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray, frozen
from reach.contact import ContactPatch
from reach.grasp import Grasp
from reach.kernels.compiling import announce_compilation
from reach.kernels.pads import pads_of
from reach.kernels.tree import mesh_tree
from reach.kernels.verdict import find_patch, make_workspace
from reach.models.base import depths
from reach.scene import Scene
from reach.transforms import apply


def compiled_patches(
    scene: Scene, grasp: Grasp, compliance: float, saturate: bool
) -> tuple[ContactPatch, ...]:
    """Find the patch of every jaw that touches, by clipping."""
    pads = pads_of(scene.gripper, grasp.opening)
    depth = depths(pads, np.array([grasp.force]), compliance, saturate)[0]
    found = []
    for jaw in range(len(depth)):
        T_object_pad = grasp.T_object_gripper @ pads.T_gripper_pad[jaw]
        announce_compilation(find_patch)
        count, high, space = find_patch(
            mesh_tree(scene.object), pads, jaw, T_object_pad, depth[jaw], make_workspace(1)
        )
        patch = describe_patch(
            jaw,
            space.triangles[:count],
            space.normals[:count],
            high,
            depth[jaw],
            grasp.force,
            T_object_pad,
            scene.object.com,
        )
        if patch is not None:
            found.append(patch)
    return tuple(found)


def describe_patch(
    jaw: int,
    triangles_pad: FloatArray,
    normals_pad: FloatArray,
    high: float,
    depth: float,
    force: float,
    T_object_pad: FloatArray,
    com_object: FloatArray,
) -> ContactPatch | None:
    """Describe a patch given in the opened pad's frame; None if it carries no pressure.

    Args:
        jaw: index of the jaw.
        triangles_pad: shape (M, 3, 3) [m].
        normals_pad: inward unit normals, shape (M, 3).
        high: depth d_con + d_def at which the pressure vanishes [m].
        depth: d_def [m].
        force: closing force: sum of the normal forces' magnitudes [N].
        T_object_pad: pose of the opened pad, shape (4, 4).
        com_object: center of mass, shape (3,).
    """
    edges = triangles_pad[:, 1:] - triangles_pad[:, :1]
    areas = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    q = (high - triangles_pad[..., 2]) * normals_pad[:, 2:]
    forces = areas * q.mean(axis=1)
    if not forces.sum() > 0:
        return None
    stiffness = force / forces.sum()
    weighted = triangles_pad.sum(axis=1) * q.sum(axis=1, keepdims=True)
    weighted += np.einsum("mi,mij->mj", q, triangles_pad)
    moments = areas[:, None] / 12.0 * weighted  # integral of q r over each triangle
    rotation = T_object_pad[:3, :3]
    force_object = stiffness * rotation @ (forces @ normals_pad)
    torque_pad = stiffness * np.cross(moments, normals_pad).sum(axis=0)
    arm = T_object_pad[:3, 3] - com_object
    T_contact = np.array(T_object_pad)
    T_contact[:3, 3] += rotation[:, 2] * (high - depth)
    mean = rotation @ (areas @ normals_pad)
    return ContactPatch(
        jaw,
        frozen(apply(T_object_pad, triangles_pad.reshape(-1, 3)).reshape(-1, 3, 3)),
        frozen(stiffness * q),
        float(areas.sum()),
        frozen(apply(T_object_pad, moments.sum(axis=0)[None] / forces.sum())[0]),
        frozen(mean / np.linalg.norm(mean)),
        frozen(force_object),
        frozen(rotation @ torque_pad + np.cross(arm, force_object)),
        frozen(T_contact),
    )
