"""`reach fit`: a station's own parameters from its labeled data."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from logs.dataset.registration_scatter import RegistrationScatter, Spread
    from reach.evaluation.fit import Fit

FITTED = ("reach-robust", "ellipse-robust", "settled-robust")
"""Models that have all the parameters to be fitted."""
UNITS = {"friction": "", "compliance": " m/N", "stiffness": " N/m^3", "translation": " m"}


def fit(
    sources: Annotated[list[Path], typer.Argument(help="Session or data-set folders.")],
    model: Annotated[str, typer.Option(help=f"One of {', '.join(FITTED)}.")] = "reach-robust",
    samples: Annotated[int, typer.Option(min=1, help="Perturbations a score.")] = 50,
    seed: Annotated[int, typer.Option(help="Of the perturbations.")] = 0,
    backend: Annotated[
        str, typer.Option(help="Where scores are computed: serial, threading or loky.")
    ] = "threading",
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Estimate friction, compliance and pose error, with intervals.

    Friction, compliance (for settled-robust the pads' stiffness) and the pose error in the hand
    are those under which the labels are most
    likely. Tilt and height of the registered poses are compared with those of a part at rest.
    What the data cannot tell is said to be so.

    - `reach fit sessions/mon sessions/tue`
    - `reach fit data/physical --json`
    """
    from collection.cli.evaluation_table import progress_bars
    from logs.dataset.registration_scatter import registration_scatter
    from logs.dataset.sources import load_labeled
    from reach.errors import UnknownNameError
    from reach.evaluation.fit import fit_parameters
    from reach.models.registry import make_scorer

    if model not in FITTED:
        raise UnknownNameError("robust model of pads", model, FITTED)
    dataset = load_labeled(sources)
    scatter = registration_scatter(dataset.trials)
    with progress_bars() as progress:
        found = fit_parameters(
            dataset.cases(),
            make_scorer,
            model=model,
            samples=samples,
            seed=seed,
            backend=backend,
            progress=lambda done, total: progress("fit", done, total),
        )
    if as_json:
        print(json.dumps(_content(found, scatter, model, dataset.simulated)))
        return
    marked = ["simulated labels: this is the simulation's station, no robot's"] * dataset.simulated
    print("\n".join([*marked, *_likelihood_lines(found, model), *_registration_lines(scatter)]))


def _content(
    found: Fit, scatter: RegistrationScatter, model: str, simulated: bool
) -> dict[str, Any]:
    registration = {
        name: value.to_json() if hasattr(value, "to_json") else value
        for name in scatter.__dataclass_fields__
        for value in [getattr(scatter, name)]
    }
    return {
        "model": model,
        "simulated": simulated,
        "grasps": found.grasps,
        "trials": found.trials,
        "overdispersion": found.overdispersion,
        "parameters": {name: one.to_json() for name, one in found.parameters.items()},
        "registration": registration,
    }


def _likelihood_lines(found: Fit, model: str) -> list[str]:
    lines = [
        f"{found.trials} labels of {found.grasps} grasps; grasps scatter "
        f"{found.overdispersion:.1f} times as much as chance alone"
    ]
    for name, one in found.parameters.items():
        label = "pose error in the hand" if name == "translation" else name
        unit = UNITS[name]
        if not one.told:
            lines.append(
                f"{label}: the data cannot tell (all of {one.low:g} to {one.high:g}{unit} is as "
                "likely)"
            )
            continue
        if one.low == one.high and not (one.bounded_below and one.bounded_above):
            lines.append(
                f"{label}: at the end of the range searched ({one.best:g}{unit}): {model} does not "
                "describe these labels, do not use the value"
            )
            continue
        low = f"{one.low:g}" if one.bounded_below else f"below {one.low:g}"
        high = f"{one.high:g}" if one.bounded_above else f"above {one.high:g}"
        lines.append(f"{label}: {one.best:g}{unit}, 95 %: {low} to {high}{unit}")
    return lines


def _registration_lines(scatter: RegistrationScatter) -> list[str]:
    rows = (
        ("tilt of registered poses", scatter.tilt, " rad"),
        ("height of registered poses", scatter.height, " m"),
        ("true rotation error (simulated)", scatter.true_rotation, " rad"),
        ("true translation error (simulated)", scatter.true_translation, " m"),
    )
    lines = [_spread_line(name, spread, unit) for name, spread, unit in rows if spread]
    if scatter.tilt is None:
        lines.append("registration: too few registered trials to tell its scatter")
    if scatter.claimed_translation is not None:
        lines.append(
            f"registrations state {scatter.claimed_rotation:.2g} rad, "
            f"{scatter.claimed_translation:.2g} m themselves"
        )
    return lines


def _spread_line(name: str, spread: Spread, unit: str) -> str:
    bias = "" if name.startswith("true") else f"mean {spread.bias:+.2g}, "
    return (
        f"{name}: {spread.value:.2g}{unit}, 95 %: {spread.low:.2g} to {spread.high:.2g}{unit} "
        f"({bias}{spread.count} values)"
    )
