"""A disk that fills up at any write: one clear error, and what was flushed stays readable."""

import json
import subprocess
import sys
from pathlib import Path

from logs.errors import RecordReadError
from logs.record.trial_record import read_record
from logs.trial_folder import PART_NAME, RECORD_NAME

SCRIPT = Path(__file__).parent / "fixtures" / "record_on_full_disk.py"


def test_a_full_disk_at_each_write(tmp_path: Path, thorough: bool) -> None:
    count = 400 if thorough else 40
    done = subprocess.run(
        [sys.executable, str(SCRIPT), str(tmp_path), str(count)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stderr == ""
    endings = json.loads(done.stdout)
    whole = read_record(tmp_path / "whole")
    size = (tmp_path / "whole" / RECORD_NAME).stat().st_size
    read = []
    for limit, ending in endings.items():
        folder = tmp_path / limit
        assert ending == ("complete" if int(limit) >= size else "refused"), limit
        assert (folder / RECORD_NAME).exists() == (ending == "complete")
        if ending == "complete" or not (folder / PART_NAME).exists():
            continue
        try:
            record = read_record(folder)
        except RecordReadError:
            read.append(0)  # full before the first flush
            continue
        read.append(record.message_count)
        assert record.descriptor.trial_id == whole.descriptor.trial_id
        expected = whole.jaw.widths[: len(record.jaw.widths)]
        assert record.jaw.widths.tolist() == expected.tolist()
    assert len(set(read)) >= 4 and read == sorted(read)
