"""Labels and scores beside a record: small files, one each, so that nothing is rewritten.

The journal is the truth; these files mirror its events for viewers and for whoever finds a
take's folder alone. Operator label and model scores never overwrite one another, and a later
revision is a later file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from reach.arrays import FloatArray, frozen
from reach.errors import InvalidInputError

ALL_LABELS = "all"
"""Withdraws every label so far: recovery could not vouch for them."""


@dataclass(frozen=True, slots=True)
class LabelRecord:
    """An operator's verdict on a take, or its withdrawal.

    Args:
        trial_id: uuid of the trial.
        take: which attempt, from 1.
        time_ns: when it was given [ns].
        event_id: of the journal's event; unique within the session.
        revision: grows with every label of the session; the newest that holds counts.
        outcome: `success` or `failure`; empty for a withdrawal.
        reason: of a failure.
        note: the operator's words.
        operator: who.
        withdraws: event id of a label that holds no longer (an undo), or ALL_LABELS.
        second: a second operator's verdict, for agreement; it never counts as the label.
        details: whatever else the event says.
    """

    trial_id: str
    take: int
    time_ns: int
    event_id: str
    revision: int
    outcome: str = ""
    reason: str = ""
    note: str = ""
    operator: str = ""
    withdraws: str = ""
    second: bool = False
    details: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class PatchRecord:
    """Where a pad touches the object, and how hard, as a model predicts it.

    Args:
        jaw: index of the jaw.
        triangles_object: shape (M, 3, 3), object frame [m].
        pressures: at the triangles' corners, shape (M, 3) [Pa].
        area: [m^2].
        center_object: shape (3,), object frame [m].
        normal_object: mean inward normal, shape (3,), object frame.
        force_object: shape (3,), object frame [N].
        T_object_pad: shape (4, 4).
    """

    jaw: int
    triangles_object: FloatArray
    pressures: FloatArray
    area: float
    center_object: FloatArray
    normal_object: FloatArray
    force_object: FloatArray
    T_object_pad: FloatArray

    def __post_init__(self) -> None:
        shapes = {
            "triangles_object": (-1, 3, 3),
            "pressures": (-1, 3),
            "center_object": (3,),
            "normal_object": (3,),
            "force_object": (3,),
            "T_object_pad": (4, 4),
        }
        for name, shape in shapes.items():
            array = frozen(getattr(self, name)).reshape(shape)
            object.__setattr__(self, name, array)
        if len(self.triangles_object) != len(self.pressures):
            raise InvalidInputError(
                f"contact patch has {len(self.triangles_object)} triangles"
                f" but pressures for {len(self.pressures)}"
            )


@dataclass(frozen=True, slots=True, eq=False)
class ScoreRecord:
    """A model's prediction for a take.

    Args:
        trial_id: uuid of the trial.
        take: which attempt, from 1.
        time_ns: when it was made [ns].
        event_id: of the journal's event.
        revision: grows with every event of the session; the newest of a model counts.
        model: its name.
        version: of the model.
        value: predicted probability of success, in [0, 1].
        seconds: what the prediction took.
        parameters: of the model, as text.
        explanation: in words.
        details: numbers by name.
        texts: further details by name.
        patches: predicted contacts.
    """

    trial_id: str
    take: int
    time_ns: int
    event_id: str
    revision: int
    model: str
    version: str
    value: float
    seconds: float = 0.0
    parameters: Mapping[str, str] = field(default_factory=dict)
    explanation: str = ""
    details: Mapping[str, float] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)
    patches: tuple[PatchRecord, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Annotations:
    """All annotations of a take, oldest first.

    Args:
        labels: verdicts and withdrawals.
        scores: predictions.
        damaged: files that could not be read, and why.
    """

    labels: tuple[LabelRecord, ...] = ()
    scores: tuple[ScoreRecord, ...] = ()
    damaged: tuple[tuple[Path, str], ...] = ()

    @property
    def label(self) -> LabelRecord | None:
        """The verdict that counts: the newest that was not withdrawn."""
        ordered = sorted(self.labels, key=lambda label: label.revision)
        held: list[LabelRecord] = []
        for label in ordered:
            if label.withdraws == ALL_LABELS:
                held.clear()
            elif label.withdraws:
                held = [one for one in held if one.event_id != label.withdraws]
            elif not label.second:
                held.append(label)
        return held[-1] if held else None

    @property
    def newest_scores(self) -> dict[str, ScoreRecord]:
        """The newest prediction of each model, in the models' alphabetical order."""
        newest = {s.model: s for s in sorted(self.scores, key=lambda s: s.revision)}
        return dict(sorted(newest.items()))

    @property
    def event_ids(self) -> frozenset[str]:
        """The journal's events that have a file."""
        labels = {label.event_id for label in self.labels}
        return frozenset(labels | {score.event_id for score in self.scores})
