"""What a model's score predicts: one threshold for every view, list and filter."""

from __future__ import annotations

from typing import Final

PREDICTS_SUCCESS: Final = 0.5


def predicts_success(score: float) -> bool:
    """Whether a score in [0, 1] names success; a score of exactly one half does."""
    return score >= PREDICTS_SUCCESS
