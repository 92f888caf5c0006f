"""What a trial asks of its cameras.

Constructors are inert; `connect()` talks to the hardware; both are context managers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from registration.frame import DepthFrame, Intrinsics


@dataclass(frozen=True, slots=True)
class CameraState:
    """What a camera says of itself, for a diagnosis."""

    connected: bool
    detail: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class ColorFrame:
    """One color image: RGB (H, W, 3) uint8, read-only, and its time [ns]."""

    image: NDArray[np.uint8]
    time_ns: int


class DepthCamera(Protocol):
    """A calibrated depth camera."""

    @property
    def name(self) -> str:
        """Of the camera, for logs."""
        ...

    @property
    def intrinsics(self) -> Intrinsics | None:
        """Of the depth image; None where only a frame can tell."""
        ...

    def connect(self) -> None:
        """Reach the camera."""
        ...

    def disconnect(self) -> None:
        """Let go of the camera; allowed at any time, more than once."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *exception: object) -> None: ...

    def state(self) -> CameraState:
        """What the camera says of itself; never raises for a camera that is merely absent."""
        ...

    def capture(self) -> DepthFrame:
        """Take a new image: nothing captured before this call is ever returned.

        Raises:
            CameraTimeoutError: no image arrived in time.
            CameraNotConnectedError: not connected.
        """
        ...


class ColorCamera(Protocol):
    """A camera that films the trial; `None` in place of a frame says that it cannot see now."""

    @property
    def name(self) -> str:
        """Of the camera, for logs."""
        ...

    def connect(self) -> None:
        """Reach the camera."""
        ...

    def disconnect(self) -> None:
        """Let go of the camera; allowed at any time, more than once."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *exception: object) -> None: ...

    def state(self) -> CameraState:
        """What the camera says of itself."""
        ...

    def frame(self) -> ColorFrame | None:
        """The newest image."""
        ...
