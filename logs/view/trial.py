"""A take's Rerun view: derived from its record and annotations alone, at any time again."""

from __future__ import annotations

from pathlib import Path

from logs.record.annotation_files import read_annotations
from logs.record.annotations import Annotations
from logs.record.trial_record import TrialRecord, read_record, record_path
from logs.trial_folder import BLIND_VIEW_NAME, VIEW_NAME, annotation_paths

APPLICATION = "reach-trials trial"
BLIND_APPLICATION = "reach-trials blind trial"


def derive_rrd(folder: Path, out: Path | None = None, *, blind: bool = False) -> Path:
    """Write a take's view.

    Args:
        folder: the take's folder.
        out: the .rrd file; by default in the take's folder.
        blind: leave out label, scores, contacts, the sensors' verdict and a simulation's truth.

    Returns:
        The file.

    Raises:
        RecordReadError: if the record cannot be read.
        ViewError: if the view cannot be written.
    """
    path = out or view_path(folder, blind=blind)
    # A view is as old as its newest source: so a copied or relabeled take is seen as such.
    time_ns = _newest_source(folder)
    record = read_record(folder)
    annotations = Annotations() if blind else read_annotations(folder)
    _write(record, annotations, path, time_ns, blind=blind)
    return path


def view_path(folder: Path, *, blind: bool = False) -> Path:
    """Where a take's view is."""
    return folder / (BLIND_VIEW_NAME if blind else VIEW_NAME)


def fresh_view(folder: Path, *, blind: bool = False) -> Path:
    """A take's view, derived anew only if record or annotations changed.

    Raises:
        RecordReadError: if the record cannot be read.
        ViewError: if the view cannot be written.
    """
    path = view_path(folder, blind=blind)
    if path.exists() and path.stat().st_mtime_ns == _newest_source(folder):
        return path
    return derive_rrd(folder, blind=blind)


def _write(
    record: TrialRecord, annotations: Annotations, path: Path, time_ns: int, *, blind: bool
) -> None:
    """Draw a record and its annotations into a file."""
    from logs.view.blueprint import blind_blueprint, trial_blueprint
    from logs.view.contacts import show_contacts
    from logs.view.eyes import object_diameter, show_anchors
    from logs.view.file import view_file
    from logs.view.object import object_triangles
    from logs.view.panels import show_panels
    from logs.view.scene import show_scene
    from logs.view.settling import show_settling
    from logs.view.stage import Stage

    described = record.descriptor
    layout = blind_blueprint(record) if blind else trial_blueprint(record)
    # The viewer merges recordings of one id, and keeps one layout for an application: a blind
    # view must share neither with the full one.
    application, suffix = (BLIND_APPLICATION, "-blind") if blind else (APPLICATION, "")
    recording_id = f"{described.trial_id}-{described.take}{suffix}"
    with view_file(application, recording_id, path, layout, time_ns) as recording:
        recording.send_recording_name(_name(record, annotations))
        stage = Stage(recording, described.time_ns)
        show_anchors(stage, record)
        show_scene(stage, record, blind=blind)
        if not blind:
            scores = annotations.newest_scores
            show_contacts(stage, scores, object_diameter(record))
            if record.execution is not None:
                closing_ns = record.execution.time_ns
                show_settling(stage, scores, object_triangles(record), closing_ns)
        show_panels(stage, record, annotations, blind=blind)


def _name(record: TrialRecord, annotations: Annotations) -> str:
    from logs.view.text import outcome_words

    described = record.descriptor
    label = annotations.label
    outcome = f" {outcome_words(label)}" if label else ""
    return f"{described.number:04d} {described.object_name}{outcome}"


def _newest_source(folder: Path) -> int:
    """Time of the newest change of what a view shows [ns]."""
    sources = [record_path(folder), *annotation_paths(folder)]
    return max(path.stat().st_mtime_ns for path in sources)
