"""Names of the scoring models; a file of its own, so that a command's help need load none."""

ANALYTIC_NAMES = (
    "reach",
    "reach-robust",
    "point",
    "point-robust",
    "ellipse",
    "ellipse-robust",
    "settled",
    "settled-robust",
)
"""Models cheap enough to score every trial with."""

MODEL_NAMES = (*ANALYTIC_NAMES, "dynamic")

JUDGES = ("settled-robust", "reach-robust", "settled", "reach")
"""Whose disagreements with the labels are shown: the first of these that scored anything."""

PATCH_MODEL = "reach"
"""The model whose contact patches are kept and shown."""
