"""Writing the report of sessions or data sets: models compared, then one page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from collection.targets import write_text
from reach.models.names import ANALYTIC_NAMES

if TYPE_CHECKING:
    from logs.report.agreement import OperatorAgreement
    from logs.report.coverage import PlanCoverage
    from reach.evaluation.table import Evaluation


def write_report(
    sources: Sequence[Path],
    page: Path,
    *,
    models: Sequence[str] = ANALYTIC_NAMES,
    pose_error: str | None = None,
    seed: int = 0,
    backend: str = "threading",
    unblinded: bool = False,
    progress: Callable[[str, int, int], None] | None = None,
) -> Evaluation:
    """Compare models on the labeled trials of sessions or data sets, and write the page.

    Args:
        sources: session or data-set folders.
        page: the HTML file; a reader sees the old one or the new one.
        models: names of the models to compare.
        pose_error: standard deviations METERS,RADIANS, instead of what the data states.
        seed: of perturbations and bootstrap.
        backend: where scores are computed.
        unblinded: let labels given after seeing a prediction replace blind ones.
        progress: told the model, how many grasps are scored, and of how many.

    Returns:
        How the models compare.

    Raises:
        InvalidInputError: the page cannot be written.
    """
    from collection.analysis.evaluating import chosen_pose_error
    from logs.dataset.sources import load_labeled
    from logs.report.page import build_report
    from reach.evaluation.backends import cluster
    from reach.evaluation.compare import compare, scorers_of

    dataset = load_labeled(sources, unblinded=unblinded)
    error, stated = chosen_pose_error(dataset, pose_error)
    with cluster(backend, None):
        result = compare(
            dataset.cases(),
            scorers_of(models),
            pose_error=error,
            seed=seed,
            backend=backend,
            progress=progress,
        )
    text = build_report(
        dataset,
        result,
        error,
        basis=stated["basis"],
        seed=seed,
        covered=_covered(sources),
        agreement=_agreement(sources),
    )
    write_text(page, text)
    return result


def _covered(sources: Sequence[Path]) -> PlanCoverage | None:
    """What the plans of these sessions cover; None where a source is no session."""
    from collection.plan.coverage import coverage
    from collection.session.setup import read_setup
    from logs.session.folder import SESSION_NAME, SessionFolder
    from reach.gripper import ParallelJawGripper

    if not all((source / SESSION_NAME).exists() for source in sources):
        return None
    setups = [read_setup(SessionFolder.open(source)) for source in sources]
    return coverage(
        [grasp for setup in setups for grasp in setup.plan.grasps],
        {name: part for setup in setups for name, part in setup.objects.items()},
        ParallelJawGripper.yumi(),
    )


def _agreement(sources: Sequence[Path]) -> OperatorAgreement | None:
    """Of all sessions' operators together; None where no source is a session."""
    from labeling.agreement import joint_agreement
    from logs.report.agreement import OperatorAgreement
    from logs.session.folder import SESSION_NAME, SessionFolder

    sessions = [source for source in sources if (source / SESSION_NAME).exists()]
    if not sessions:
        return None
    found = joint_agreement(SessionFolder.open(path).read_state() for path in sessions)
    return OperatorAgreement(found.pairs, found.agreed, found.kappa, found.interval)
