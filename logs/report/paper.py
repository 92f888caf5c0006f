"""Table 1 of the paper, for comparison.

[Danielczuk2019] Danielczuk et al., REACH: Reducing False Negatives in Robot Grasp Planning with a
Robust Efficient Area Contact Hypothesis Model, ISRR 2019: 21 objects, 25 grasps each, 5 trials a
grasp on a YuMi; parameters chosen by leave-one-object-out cross-validation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PaperRow:
    """What the paper reports of a model: AP, AR and seconds per grasp."""

    ap: float
    ar: float
    seconds: float


PAPER_TABLE: Mapping[str, PaperRow] = {
    "point": PaperRow(0.76, 0.55, 0.006),
    "point-robust": PaperRow(0.82, 0.55, 0.040),
    "ellipse": PaperRow(0.73, 0.47, 0.024),
    "ellipse-robust": PaperRow(0.73, 0.47, 0.220),
    "reach": PaperRow(0.77, 0.72, 0.053),
    "reach-robust": PaperRow(0.82, 0.66, 0.520),
    "dynamic": PaperRow(0.86, 0.54, 10.3),
}
"""The paper's dynamic model is Flex, on a V100."""
