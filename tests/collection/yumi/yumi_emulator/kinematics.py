"""The emulated arm's geometry: the published kinematic table of the IRB 14000.

Joints are in the controller's order 1..6 and 7 last, [rad]; poses in mm, as the controller has them.
The flange (tool0) is 7 mm beyond link 7 and turned by pi about its z axis. The controller's
own, calibrated geometry differs from the published table by about 1.5 mm, as it does at the
home position: `OFFSET`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Vector = NDArray[np.float64]

_FIRST = {
    "R": (0.05355, -0.0725, 0.41492, -0.9795, -0.5682, -2.3155),
    "L": (0.05355, 0.0725, 0.41492, 0.9781, -0.5716, 2.3180),
}
_H = np.pi / 2
_REST = (
    (0.03, 0, 0.1, _H, 0, 0),
    (-0.03, 0.17283, 0, -_H, 0, 0),
    (-0.04188, 0, 0.07873, _H, -_H, 0),
    (0.0405, 0.16461, 0, -_H, 0, 0),
    (-0.027, 0, 0.10039, _H, 0, 0),
    (0.027, 0.029, 0, -_H, 0, 0),
)
_FLANGE = (0, 0, 0.007, 0, 0, np.pi)
_CHAIN = [0, 1, 6, 2, 3, 4, 5]  # the controller's index of each joint along the chain
LOWER = np.array([-2.94088, -2.50455, -2.15548, -5.06145, -1.53589, -3.99680, -2.94088])
UPPER = np.array([2.94088, 0.759218, 1.39626, 5.06145, 2.40855, 3.99680, 2.94088])
MAX_SPEED = np.array([3.14159, 3.14159, 3.14159, 6.98132, 6.98132, 6.98132, 3.14159])
OFFSET = {"R": np.array([0.22, -0.20, 1.59]), "L": np.array([0.73, -0.41, 1.14])}
HOME = {
    side: np.deg2rad([0, -130, 30, 0, 40, 0, sign * 135]) for side, sign in (("R", -1), ("L", 1))
}


class NoSolutionError(Exception):
    """`outside` if even without joint limits no joints reach the target."""

    def __init__(self, outside: bool) -> None:
        super().__init__("outside reach" if outside else "joint limit")
        self.outside = outside


@dataclass(frozen=True)
class Chain:
    side: str

    def frames(self, joints: Vector) -> list[Vector]:
        """Base-frame poses [m] of the seven joints' links and of the flange, each (4, 4)."""
        T, frames = np.eye(4), []
        origins = [_FIRST[self.side], *_REST]
        for origin, index in zip(origins, _CHAIN, strict=True):
            T = T @ _origin(origin) @ _turn(joints[index])
            frames.append(T)
        return [*frames, T @ _origin(_FLANGE)]

    def forward(self, joints: Vector) -> Vector:
        """Pose of tool0 in the base frame, position in mm."""
        T = self.frames(joints)[-1].copy()
        T[:3, 3] = T[:3, 3] * 1000 + OFFSET[self.side]
        return T

    def arm_angle(self, joints: Vector) -> float:
        """Turn of the elbow about the line from shoulder to wrist, against the vertical [rad]."""
        frames = self.frames(joints)
        shoulder, elbow, wrist = (frames[i][:3, 3] for i in (1, 3, 5))
        axis = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
        up = np.cross(axis, np.cross([0.0, 0.0, 1.0], axis))
        out = np.cross(axis, np.cross(elbow - shoulder, axis))
        return float(np.arctan2(axis @ np.cross(up, out), up @ out))

    def inverse(self, T: Vector, arm_angle: float, seed: Vector) -> Vector:
        """Joints for a tool0 pose [mm] and an arm angle, on the branch of the seed.

        Raises:
            NoSolutionError: out of reach, or beyond the joints' limits.
        """
        joints = np.array(seed)
        for _ in range(100):
            error = self._error(joints, T, arm_angle)
            if np.abs(error).max() < 1e-9:
                break
            J = self._jacobian(joints, arm_angle)
            step = J.T @ np.linalg.solve(J @ J.T + 1e-8 * np.eye(7), error)
            joints = joints + step * min(1.0, 0.3 / max(np.abs(step).max(), 1e-12))
        if np.abs(self._error(joints, T, arm_angle)[:6]).max() > 1e-6:
            raise NoSolutionError(outside=True)
        if np.any(joints < LOWER) or np.any(joints > UPPER):
            raise NoSolutionError(outside=False)
        return joints

    def _error(self, joints: Vector, T: Vector, arm_angle: float) -> Vector:
        here = self.forward(joints)
        turn = Rotation.from_matrix(T[:3, :3] @ here[:3, :3].T).as_rotvec()
        elbow = (arm_angle - self.arm_angle(joints) + np.pi) % (2 * np.pi) - np.pi
        return np.concatenate([(T[:3, 3] - here[:3, 3]) / 1000, turn, [elbow]])

    def _jacobian(self, joints: Vector, arm_angle: float) -> Vector:
        frames = self.frames(joints)
        tip, J = frames[-1][:3, 3], np.zeros((7, 7))
        for frame, index in zip(frames[:7], _CHAIN, strict=True):
            axis = frame[:3, 2]
            J[:3, index], J[3:6, index] = np.cross(axis, tip - frame[:3, 3]), axis
        for index in range(7):
            ahead, behind = joints.copy(), joints.copy()
            ahead[index] += 1e-6
            behind[index] -= 1e-6
            J[6, index] = (self.arm_angle(ahead) - self.arm_angle(behind)) / 2e-6
        return J


@cache
def _origin(origin: tuple[float, ...]) -> Vector:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("xyz", origin[3:]).as_matrix()
    T[:3, 3] = origin[:3]
    return T


def _turn(angle: float) -> Vector:
    T = np.eye(4)
    c, s = np.cos(angle), np.sin(angle)
    T[:2, :2] = [[c, -s], [s, c]]
    return T
