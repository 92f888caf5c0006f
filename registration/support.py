"""What the table tells about a part that stands on it: the corners that carry it touch it."""

from __future__ import annotations

import numpy as np

from reach.arrays import FloatArray

CARRYING = 1e-4
"""Corners of the hull this close above the lowest one carry the part: a printed layer [m]."""
TOUCH = 1.5e-5
"""Standard deviation of a carrying corner's height above the fitted plane [m]. A rough foot or dust
may lift a real part by more; that is within what calibration allows for (decision 0047)."""


class Support:
    """The table's hold on height and tilt.

    A wide foot is held level; a round belly, which touches with little, may roll as the image
    says. The corners count as three independent ones however many there are: what lifts one
    lifts its neighbors.

    Args:
        up_ideal: direction that points up in the ideal stable pose, shape (3,), object frame.
        hull_vertices: corners of the part's convex hull, shape (H, 3), object frame [m].
        up_camera: the table's normal, shape (3,), camera frame.
        table_offset: up_camera @ p of points p on the table [m].
    """

    def __init__(
        self,
        up_ideal: FloatArray,
        hull_vertices: FloatArray,
        up_camera: FloatArray,
        table_offset: float,
    ) -> None:
        height = (hull_vertices * up_ideal).sum(axis=1)
        self._corners = hull_vertices[height < height.min() + CARRYING]
        self._up, self._offset = up_camera, table_offset
        self._gain = min(1.0, 3 / len(self._corners)) / TOUCH**2

    def information(self, T: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Information matrix (6, 6) and gradient (6,) at a pose T_camera_object (4, 4)."""
        up_object = (T[:3, :3] * self._up[:, None]).sum(axis=0)
        height = (self._corners * up_object).sum(axis=1)
        residual = height + float((self._up * T[:3, 3]).sum()) - self._offset
        jacobian = np.empty((len(self._corners), 6))
        jacobian[:, :3] = np.cross(self._corners, up_object)
        jacobian[:, 3:] = up_object
        products = jacobian[:, :, None] * jacobian[:, None, :]
        information: FloatArray = self._gain * products.sum(axis=0)
        gradient: FloatArray = self._gain * (jacobian * residual[:, None]).sum(axis=0)
        return information, gradient
