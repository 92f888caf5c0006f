"""A contact as a point: its place, its normal force, and the friction it can bear."""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray
from reach.kernels.compiling import compiled
from reach.kernels.elements import wrench_in_frame


@compiled
def place_contact(
    T_wrench_pad: FloatArray,
    point_pad: FloatArray,
    normal_pad: FloatArray,
    point: FloatArray,
    normal: FloatArray,
) -> None:
    """Write a contact's point and normal in the frame of the wrenches."""
    for i in range(3):
        point[i], normal[i] = T_wrench_pad[i, 3], 0.0
        for j in range(3):
            point[i] += T_wrench_pad[i, j] * point_pad[j]
            normal[i] += T_wrench_pad[i, j] * normal_pad[j]


@compiled
def write_friction_point(
    elements: FloatArray,
    column: int,
    c: FloatArray,
    normal: FloatArray,
    slide: bool,
    turn: float,
    force: float,
    length: float,
) -> None:
    """Write a friction point: sliding perpendicular to a normal (or not), torsion about it."""
    for i in range(3):
        elements[i, column] = c[i] / length
        elements[3 + i, column] = 1.0 - normal[i] * normal[i] if slide else 0.0
        elements[9 + i, column] = normal[i] * turn / length
    elements[6, column] = -normal[0] * normal[1] if slide else 0.0
    elements[7, column] = -normal[0] * normal[2] if slide else 0.0
    elements[8, column] = -normal[1] * normal[2] if slide else 0.0
    elements[12, column] = force


@compiled
def write_normal_force(
    c: FloatArray, normal: FloatArray, force: float, length: float, wrench: FloatArray
) -> None:
    """Write the wrench of a force along a normal at a point, torques scaled."""
    wrench_in_frame(
        force * normal[0],
        force * normal[1],
        force * normal[2],
        force * (c[1] * normal[2] - c[2] * normal[1]),
        force * (c[2] * normal[0] - c[0] * normal[2]),
        force * (c[0] * normal[1] - c[1] * normal[0]),
        np.eye(4),
        length,
        wrench,
    )
