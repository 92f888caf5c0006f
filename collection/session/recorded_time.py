"""When a session was last recorded, so that a clock that stood still goes on from there."""

from __future__ import annotations

from pathlib import Path

from mcap.reader import make_reader

from logs.session.folder import SessionFolder


def last_recorded_ns(session: Path) -> int:
    """Latest time in any record of a session [ns]; when it was created if there is none.

    Args:
        session: the session's folder.
    """
    folder = SessionFolder.open(session)
    ends = [_end_ns(path) for path in folder.trials.rglob("trial*.mcap")]
    return max([folder.descriptor.created_ns, *ends])


def _end_ns(record: Path) -> int:
    """Time of a record's last message; 0 for one that was torn."""
    try:
        with record.open("rb") as stream:
            summary = make_reader(stream).get_summary()
    except Exception:  # any parser may meet any error in damaged bytes
        return 0
    statistics = summary.statistics if summary else None
    return statistics.message_end_time if statistics else 0
