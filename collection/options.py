"""What the operator chose for a session, resolved: it travels with the session."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

from reach.models.names import ANALYTIC_NAMES, MODEL_NAMES

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
    seed: int = 0
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
