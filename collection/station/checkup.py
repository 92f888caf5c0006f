"""What `reach doctor` looks at before anyone trusts a day to a station."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from reach.errors import ReachError

if TYPE_CHECKING:
    from collection.station.station import Station

LARGE_REPROJECTION = 0.5
"""A good chessboard calibration stays well below this [pixel]."""
LARGE_POSITION_STD = 1e-3
FEW_TRIALS = 200
PORT_TIMEOUT = 2.0
"""For a connection on this machine [s]."""


class Status(StrEnum):
    """How a check came out; only `fail` keeps a session from being started."""

    OK = "ok"
    WARN = "warn"
    FAIL = "fail"


@dataclass(frozen=True, slots=True)
class Check:
    """One thing that was looked at."""

    name: str
    status: Status
    detail: str


@runtime_checkable
class Examined(Protocol):
    """A device that can be asked for more than its protocol's state."""

    def checks(self) -> Iterator[Check]:
        """Look at the device; moves nothing."""
        ...


def examine(station: Station, folder: Path, *, capture: bool = False) -> Iterator[Check]:
    """Look at robot, hand, camera, calibration, ports and disk; moves nothing.

    Args:
        station: not connected.
        folder: where sessions will be kept.
        capture: take an image, too.
    """
    yield from guarded("arm", lambda: _arm(station))
    yield from guarded("gripper", lambda: _gripper(station))
    yield from guarded("camera", lambda: _camera(station, capture=capture))
    yield from guarded("calibration", lambda: _calibration(station))
    yield from _pose_error(station)
    yield from _port()
    yield from _disk(folder)


def guarded(name: str, look: Callable[[], Iterator[Check]]) -> Iterator[Check]:
    """Turn an error into a failed check, so that the next ones are still looked at."""
    try:
        yield from look()
    except ReachError as error:
        yield Check(name, Status.FAIL, str(error))


def passed(name: str, good: bool, detail: str, otherwise: Status = Status.FAIL) -> Check:
    """A check that is fine if `good`."""
    return Check(name, Status.OK if good else otherwise, detail)


def _arm(station: Station) -> Iterator[Check]:
    arm = station.arm
    if isinstance(arm, Examined):
        yield from arm.checks()
        return
    with arm:
        state = arm.state()
        yield passed("arm", state.ready, state.error or arm.name)


def _gripper(station: Station) -> Iterator[Check]:
    with station.arm, station.gripper as gripper:
        state = gripper.state()
        yield passed("gripper", state.connected and not state.error, state.error or gripper.name)
        detail = "calibrated" if state.calibrated else "calibrated at the first opening"
        yield passed("gripper calibration", state.calibrated, detail, Status.WARN)


def _camera(station: Station, *, capture: bool) -> Iterator[Check]:
    import numpy as np

    camera = station.camera
    state = camera.state()
    if not state.connected:
        with camera:  # says why not
            state = camera.state()
    yield Check("camera", Status.OK, f"{camera.name}: {state.detail}".rstrip(": "))
    if capture:
        with camera:
            frame = camera.capture()
        seen = float(np.isfinite(frame.depth).mean())
        yield passed("image", seen > 0.5, f"depth in {100 * seen:.0f} % of the pixels", Status.WARN)


def _calibration(station: Station) -> Iterator[Check]:
    from collection.calibration.calibration import calibration_of

    found = calibration_of(station.camera)
    if found is None:
        yield _uncalibrated(station)
        return
    good = found.reprojection_rms < LARGE_REPROJECTION and found.position_std < LARGE_POSITION_STD
    yield passed(
        "calibration",
        good,
        f"{len(found.views)} views, reprojection {found.reprojection_rms:.2f} pixel, position"
        f" to {1000 * found.position_std:.2f} mm, views agree to"
        f" {1000 * found.translation_rms:.2f} mm",
        Status.WARN,
    )


def _uncalibrated(station: Station) -> Check:
    """What it means that the station file names no calibration."""
    from collection.cameras.folder import FolderCamera

    if station.simulation is not None:
        return Check("calibration", Status.OK, "simulated")
    if isinstance(station.camera, FolderCamera):
        detail = "none named: every frame must bring its T_world_camera, or run `reach calibrate`"
        return Check("calibration", Status.WARN, detail)
    detail = "the station file names no calibration: run `reach calibrate`"
    return Check("calibration", Status.FAIL, detail)


def _pose_error(station: Station) -> Iterator[Check]:
    known = station.config.pose_error
    detail = {
        "stated": "as the station file states it",
        "calibration": "the calibration's residuals; [pose_error] does not state the actuation's",
        "unknown": "not stated: measure it and write [pose_error]; robust scores leave it out",
    }[known.source]
    yield passed("pose error", known.source == "stated", detail, Status.WARN)


def _port() -> Iterator[Check]:
    """Serve something and fetch it, as the operator's browser will."""
    try:
        with socket.create_server(("127.0.0.1", 0)) as server:
            server.settimeout(PORT_TIMEOUT)
            place = server.getsockname()
            with socket.create_connection(place, PORT_TIMEOUT) as page, server.accept()[0] as end:
                end.sendall(b"page")
                page.settimeout(PORT_TIMEOUT)
                arrived = page.recv(4) == b"page"
    except OSError as error:
        yield Check("ports", Status.FAIL, f"the operator's page cannot be served: {error}")
        return
    yield passed("ports", arrived, f"the operator's page can be served (tried port {place[1]})")


def _disk(folder: Path) -> Iterator[Check]:
    import shutil

    from logs.disk import FIRST_GUESS_BYTES, RESERVE_BYTES

    place = folder.resolve()
    while not place.exists():
        place = place.parent
    free = shutil.disk_usage(place).free
    trials = max(0, (free - RESERVE_BYTES) // FIRST_GUESS_BYTES)
    detail = f"{free / 2**30:.1f} GiB free at {place}, about {trials} trials"
    yield passed("disk", trials >= FEW_TRIALS, detail, Status.WARN if trials else Status.FAIL)
