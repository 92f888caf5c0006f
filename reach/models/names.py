"""Names of the scoring models; a file of its own, so that a command's help need load none."""

ANALYTIC_NAMES = (
    "point",
    "point-robust",
    "ellipse",
    "ellipse-robust",
    "reach",
    "reach-robust",
    "settled",
    "settled-robust",
)
"""Models cheap enough to score every trial with, in the order of the paper's Table 1."""

MODEL_NAMES = (*ANALYTIC_NAMES, "dynamic")

JUDGES = ("settled-robust", "reach-robust", "settled", "reach")
"""Whose disagreements with the labels are shown: the first of these that scored anything."""

PATCH_MODEL = "reach"
"""The model whose contact patches are kept and shown."""
