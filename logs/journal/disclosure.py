"""To whom a grasp's predictions were shown: the part of the fold that decides what is blind.

Repeats of a grasp share their prediction, so it is a secret of the grasp and not of one trial:
it is shown once none of the grasp's trials waits for a label any longer. Who was shown it stays
so, also if one of the trials is asked for again.
"""

from __future__ import annotations

from collections.abc import Iterable

from logs.journal.trial_state import TrialState

WAITING = ("pending", "running", "unlabelled")


class Disclosure:
    """Which grasps' scores are shown, and who has seen them.

    Args:
        trials: all trials of the session.
    """

    def __init__(self, trials: Iterable[TrialState]) -> None:
        self._repeats: dict[str, list[TrialState]] = {}
        for trial in trials:
            self._repeats.setdefault(trial.planned.grasp_id, []).append(trial)
        self._seen: dict[str, set[str]] = {grasp: set() for grasp in self._repeats}

    def shows(self, grasp_id: str) -> bool:
        """True if no trial of the grasp is still to be labeled."""
        return all(trial.status not in WAITING for trial in self._repeats[grasp_id])

    def seen_by(self, grasp_id: str) -> frozenset[str]:
        """The operators to whom a score of the grasp was shown."""
        return frozenset(self._seen[grasp_id])

    def note(self, grasp_id: str, leader: str | None) -> None:
        """Note who sees the grasp's scores as the session stands now.

        Args:
            grasp_id: the grasp; nothing happens while its scores are hidden, or before it has any.
            leader: who leads the sitting under way and therefore looks at its console.
        """
        takes = [take for trial in self._repeats[grasp_id] for take in trial.takes]
        if not any(take.scores for take in takes) or not self.shows(grasp_id):
            return
        labels = (label for take in takes for _, label in take.labels)
        self._seen[grasp_id] |= {label.operator for label in labels}
        if leader is not None:
            self._seen[grasp_id].add(leader)

    def note_all(self, leader: str) -> None:
        """Note that a sitting begins: its leader sees whatever is shown by now."""
        for grasp_id in self._repeats:
            self.note(grasp_id, leader)
