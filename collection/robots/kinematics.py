"""Forward kinematics of a serial arm, for many configurations at once."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from collection.robots.chain_kernels import fill_all_frames
from reach.arrays import FloatArray, frozen
from reach.transforms import make_transform, rotation_about


@dataclass(frozen=True, slots=True, eq=False)
class SerialChain:
    """Revolute joints one after the other, each about its own z axis.

    Args:
        T_parent_joint: fixed pose of each joint in its parent link, shape (J, 4, 4).
        T_last_tip: pose of the tip's frame in the last link, shape (4, 4).
        lower: joint limits, shape (J,) [rad].
        upper: joint limits, shape (J,) [rad].
        max_speed: shape (J,) [rad/s].
    """

    T_parent_joint: FloatArray
    T_last_tip: FloatArray
    lower: FloatArray
    upper: FloatArray
    max_speed: FloatArray

    def __len__(self) -> int:
        return len(self.lower)

    def inside_limits(self, margin: float) -> SerialChain:
        """The same chain with limits drawn in by a margin [rad]."""
        return replace(self, lower=frozen(self.lower + margin), upper=frozen(self.upper - margin))

    def link_frames(self, joints: FloatArray) -> FloatArray:
        """Poses T_base_link of all links, and last the tip's, shape (..., J + 1, 4, 4).

        Args:
            joints: shape (..., J) [rad].
        """
        flat = np.ascontiguousarray(joints, dtype=float).reshape(-1, len(self))
        frames = np.empty((len(flat), len(self) + 1, 4, 4))
        fill_all_frames(self.T_parent_joint, self.T_last_tip, flat, frames)
        return frames.reshape(*np.shape(joints)[:-1], len(self) + 1, 4, 4)

    def forward(self, joints: FloatArray) -> FloatArray:
        """Pose T_base_tip of the tip, shape (..., 4, 4)."""
        tip: FloatArray = self.link_frames(joints)[..., -1, :, :]
        return tip


def from_table(
    rows: list[tuple[tuple[float, float, float], tuple[float, float, float], float, float, float]],
    T_last_tip: FloatArray,
) -> SerialChain:
    """Build a chain from rows of (xyz [m], roll-pitch-yaw [rad], lower, upper, max speed)."""
    poses = [
        make_transform(
            rotation_about((0, 0, 1), yaw)
            @ rotation_about((0, 1, 0), pitch)
            @ rotation_about((1, 0, 0), roll),
            xyz,
        )
        for xyz, (roll, pitch, yaw), *_ in rows
    ]
    lower, upper, speed = (frozen([row[k] for row in rows]) for k in (2, 3, 4))
    return SerialChain(frozen(poses), frozen(T_last_tip), lower, upper, speed)
