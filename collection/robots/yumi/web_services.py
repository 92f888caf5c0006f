"""The controller's Robot Web Services through `abb-robot-client`, with typed errors.

The client library waits forever for a controller that does not answer; here every request has a
time-out, and whatever cuts the line is a `ConnectionLostError`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

import numpy as np

from collection.errors import ConnectionLostError, MissingExtraError, RobotError
from reach.arrays import FloatArray
from reach.transforms import as_transform, make_transform, rotation_from_quat_wxyz

Answer = TypeVar("Answer")
MODULE = "ReachTrials"


@dataclass(frozen=True, slots=True)
class ControllerState:
    """State of the whole controller, in its own words.

    Args:
        mode: `AUTO`, `MANR` (manual, reduced speed), ...
        motors: `motoron`, `motoroff`, `emergencystop`, `guardstop`, ...
        running: whether the RAPID programs run.
    """

    mode: str
    motors: str
    running: bool


@dataclass(frozen=True, slots=True)
class Event:
    """A message of the controller's event log; `kind` is 1 information, 2 warning, 3 error."""

    number: int
    kind: int
    code: int
    title: str


class WebServices:
    """One session with a controller.

    Args:
        url: `http://192.168.125.1`.
        user: name of the controller's user.
        password: of that user.
        timeout: of every request [s].
    """

    def __init__(self, url: str, user: str, password: str, timeout: float) -> None:
        self._make = partial(_open_client, url, user, password, timeout)
        self._url = url
        self._client: Any = None

    @property
    def connected(self) -> bool:
        """Whether a session is open (the line may have been cut since)."""
        return self._client is not None

    def connect(self) -> None:
        """Open a session.

        Raises:
            MissingExtraError: the extra `[yumi]` is not installed.
        """
        if self._client is None:
            self._client = self._make()

    def close(self) -> None:
        """Give the session back: the controller has 70."""
        client, self._client = self._client, None
        if client is not None:
            client.close()

    def reconnect(self) -> None:
        """Drop the session and open a new one."""
        self.close()
        self.connect()

    def state(self) -> ControllerState:
        """Mode, motors and program execution.

        Raises:
            ConnectionLostError: no answer.
        """
        return ControllerState(
            mode=str(self._call(lambda client: client.get_operation_mode())),
            motors=str(self._call(lambda client: client.get_controller_state())),
            running=self._call(lambda client: client.get_execution_state()).ctrlexecstate
            == "running",
        )

    def is_running(self) -> bool:
        """Whether the RAPID programs run."""
        execution = self._call(lambda client: client.get_execution_state())
        return bool(execution.ctrlexecstate == "running")

    def tasks(self) -> dict[str, bool]:
        """Names of the motion tasks, and whether each is active."""
        tasks = self._call(lambda client: client.get_tasks())
        return {name: bool(task.active) for name, task in tasks.items() if task.motiontask}

    def motors_on(self) -> None:
        """Switch the motors on; the controller refuses it in manual mode."""
        self._call(lambda client: client.set_controller_state("motoron"))

    def restart_programs(self) -> None:
        """Set every program pointer to main and start; tasks that are not active stay so."""
        if self.is_running():
            self.stop_programs()
        self._call(lambda client: client.resetpp())
        active = [name for name, is_active in self.tasks().items() if is_active]
        self._call(lambda client: client.start(cycle="forever", tasks=active))

    def stop_programs(self) -> None:
        """Stop all programs, and with them all motion."""
        self._call(lambda client: client.stop())

    def read(self, task: str, name: str) -> str:
        """Text of a persistent variable of our module."""
        return str(self._call(lambda client: client.get_rapid_variable(f"{MODULE}/{name}", task)))

    def write(self, task: str, name: str, text: str) -> None:
        """Set a persistent variable of our module."""
        self._call(lambda client: client.set_rapid_variable(f"{MODULE}/{name}", text, task))

    def joints_deg(self, unit: str) -> FloatArray:
        """Axes 1 to 6, and 7 last, of a mechanical unit, shape (7,) [deg]."""
        target = self._call(lambda client: client.get_jointtarget(unit))
        return np.array([*target.robax, target.extax[0]], dtype=float)

    def T_base_tool(self, unit: str) -> FloatArray:
        """Pose of tool0 in the base frame, shape (4, 4) [m]."""
        target = self._call(lambda client: client.get_robtarget(unit))
        rotation = rotation_from_quat_wxyz(target.rot)
        return as_transform(make_transform(rotation, np.array(target.trans) / 1000), "robtarget")

    def events(self) -> list[Event]:
        """The controller's newest messages, newest first."""
        log = self._call(lambda client: client.read_event_log())
        events = [Event(entry.seqnum, entry.msgtype, entry.code, entry.title) for entry in log]
        return sorted(events, key=lambda event: -event.number)

    def _call(self, ask: Callable[[Any], Answer]) -> Answer:
        if self._client is None:
            raise ConnectionLostError(f"no session with the controller at {self._url}")
        with _typed_errors(self._url):
            return ask(self._client)


@contextmanager
def _typed_errors(url: str) -> Iterator[None]:
    """Turn what the client library raises into this station's errors."""
    import requests
    from abb_robot_client.rws import ABBException

    try:
        yield
    except requests.RequestException as error:
        raise ConnectionLostError(f"the controller at {url} does not answer: {error}") from error
    except ABBException as error:
        raise RobotError(f"the controller refuses: {error} (code {error.code})") from error
    except RobotError:
        raise
    except (KeyError, TypeError, ValueError) as error:  # the library took the answer for granted
        raise RobotError(
            f"what answers at {url} does not speak Robot Web Services 1.0 ({error!r}): is it an IRC5"
            " with RobotWare 6?"
        ) from error
    except Exception as error:  # the library raises plain Exception for HTTP errors
        raise RobotError(f"the controller at {url}: {error}") from error


def _open_client(url: str, user: str, password: str, request_timeout: float) -> Any:
    try:
        from abb_robot_client.rws import RWS
    except ImportError as error:
        raise MissingExtraError("the YuMi driver", "yumi") from error
    from requests.adapters import HTTPAdapter

    class TimedAdapter(HTTPAdapter):
        def send(
            self,
            request: Any,
            stream: bool = False,
            timeout: Any = None,
            verify: Any = True,
            cert: Any = None,
            proxies: Any = None,
        ) -> Any:
            limit = request_timeout if timeout is None else timeout
            return super().send(request, stream, limit, verify, cert, proxies)

    class TimedRWS(RWS):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__(url, user, password)
            self._session.mount("http://", TimedAdapter())
            self._session.trust_env = False  # no proxy between a robot and its computer

    return TimedRWS()
