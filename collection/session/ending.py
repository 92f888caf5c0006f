"""How a session is ended from outside: by a signal, and what is done to the robot then."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collection.station.station import Station
    from labeling.control.controller import SessionController


ENDING = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


def stop_station(station: Station) -> None:
    """Stop arm and hand, both whatever becomes of the other.

    Raises:
        RobotError: a stop did not reach its device; the operator must use the hardware stop.
    """
    with ExitStack() as stops:  # runs every one, and raises what went wrong
        stops.callback(station.gripper.stop)
        stops.callback(station.arm.stop)


@contextmanager
def ending_on_signals(
    controller: SessionController, station: Station, say: Callable[[str], None]
) -> Iterator[None]:
    """SIGTERM, Ctrl-C and a lost terminal end the session in order, after the robot's motion.

    A second Ctrl-C stops the robot and ends at once.

    Args:
        controller: the session's writer.
        station: the devices.
        say: tells the operator at the terminal.
    """

    def end(signum: int, _frame: object) -> None:
        if signum == signal.SIGINT and controller.ending:
            stop_station(station)
            raise KeyboardInterrupt
        with suppress(OSError):  # the terminal may be gone
            say("ending; the robot finishes its motion first (Ctrl-C stops it)")
        controller.request_end()

    before = {number: signal.signal(number, end) for number in ENDING}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
