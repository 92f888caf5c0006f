"""Writing the report of sessions or data sets: models compared, then one page."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from reach.errors import InvalidInputError

if TYPE_CHECKING:
    from logs.report.agreement import OperatorAgreement
    from logs.report.coverage import PlanCoverage
    from reach.evaluation.table import Evaluation

REPORT_MODELS = (
    "point",
    "point-robust",
    "ellipse",
    "ellipse-robust",
    "reach",
    "reach-robust",
    "settled",
    "settled-robust",
)


def write_report(
    sources: Sequence[Path],
    page: Path,
    *,
    models: Sequence[str] = REPORT_MODELS,
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


def check_targets(paths: Iterable[Path | None]) -> None:
    """Refuse, before any work, files that could not be written after it.

    Args:
        paths: files; None for one that was not asked for.

    Raises:
        InvalidInputError: if one is a folder, or its folder can neither be written to nor made.
    """
    for path in (path for path in paths if path is not None):
        try:
            if path.is_dir():
                raise IsADirectoryError(f"{path} is a folder")
            folder = next(one for one in path.absolute().parents if one.exists())
            with TemporaryDirectory(prefix=".writing-", dir=folder):
                pass
        except OSError as error:
            raise InvalidInputError(f"cannot write {path}: {error}") from error


def write_text(path: Path, text: str) -> None:
    """Write a file whole: a reader sees the old one or the new one.

    Raises:
        InvalidInputError: if it cannot be written.
    """
    temporary = path.with_name(f".{path.name}.writing-{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise InvalidInputError(f"cannot write {path}: {error}") from error
