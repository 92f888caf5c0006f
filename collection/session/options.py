"""What the operator chose for a session, resolved: it travels with the session."""

from __future__ import annotations

import getpass
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

from reach.models.names import ANALYTIC_NAMES, MODEL_NAMES

if TYPE_CHECKING:
    from labeling.control.commands import Actor
    from labeling.server.access import Access

OperatorKind = Literal["auto", "web", "terminal"]


class SessionOptions(BaseModel):
    """The options of `reach collect`.

    Args:
        station: name of a packaged station, or path of a station file.
        objects: built-in names or mesh files.
        grasps: per object.
        repeats: of each grasp.
        operator: a page, a terminal, or the simulated operator.
        seed: everything random follows from it.
        session: 0, 1, ...: another number gives further grasps and trials of the same experiment.
        mesh_unit: unit of the mesh files' numbers.
        models: whose predictions annotate each trial.
        min_probability: stable poses below it are not planned.
        attempts: so many void takes in a row, and a trial that nobody watches is skipped.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    station: str = "simulated"
    objects: tuple[str, ...]
    grasps: Annotated[int, Field(ge=1)] = 25
    repeats: Annotated[int, Field(ge=1)] = 5
    operator: OperatorKind = "web"
    seed: Annotated[int, Field(ge=0)] = 0
    session: Annotated[int, Field(ge=0)] = 0
    mesh_unit: str = "m"
    models: tuple[str, ...] = ANALYTIC_NAMES
    min_probability: Annotated[float, Field(ge=0, lt=1)] = 0.01
    attempts: Annotated[int, Field(ge=1)] = 8

    @field_validator("models")
    @classmethod
    def _known(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        for name in names:
            if name not in MODEL_NAMES:
                raise ValueError(f"no model {name!r}; the models are {', '.join(MODEL_NAMES)}")
        return names


@dataclass(frozen=True, slots=True)
class Sitting:
    """Who labels, and where the console listens: of one sitting, not of the session.

    Args:
        name: of the person; the login name if None.
        host: address that the console listens on.
        port: its port; 0 takes a free one.
        token: secret of the console, needed beyond this machine.
        certificate: TLS certificate (PEM), needed beyond this machine.
        key: its private key (PEM).
    """

    name: str | None = None
    host: str = "127.0.0.1"
    port: int = 0
    token: str | None = None
    certificate: Path | None = None
    key: Path | None = None

    @property
    def person(self) -> str:
        """Name of who sits at the station."""
        return self.name or getpass.getuser()

    def actor(self) -> Actor:
        """The person, as the console knows them."""
        from labeling.control.commands import Actor
        from logs.journal.events import Source

        return Actor(self.person, Source.OPERATOR)

    def access(self) -> Access:
        """How the console is reached.

        Raises:
            UnsafeAddressError: others could reach it without a token and TLS.
        """
        from labeling.server.access import make_access
        from labeling.server.server import free_port

        return make_access(
            self.host,
            self.port or free_port(self.host),
            token=self.token,
            certificate=self.certificate,
            key=self.key,
        )
