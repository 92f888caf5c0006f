"""SIGKILL at any moment: every message that was confirmed durable reads back."""

import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from logs.record.salvage import salvage
from logs.record.trial_record import read_record

SCRIPT = Path(__file__).parent / "fixtures" / "sample_trial.py"


def run_and_kill(folder: Path, rng: random.Random) -> int:
    """Record in another process, kill it at a random moment; the last confirmed sample."""
    command = [sys.executable, str(SCRIPT), str(folder), "400"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        confirmed = -1
        for _ in range(rng.randrange(1, 120)):
            words = process.stdout.readline().split()
            if words[:1] != ["durable"]:
                break
            confirmed = int(words[1])
        time.sleep(rng.random() * 0.004)  # so that it dies within a write, not at its end
        process.send_signal(signal.SIGKILL)
        rest = process.stdout.read().split("\n")
    tails = [int(line.split()[1]) for line in rest if line.startswith("durable ") and line[8:]]
    return max([confirmed, *tails])


@pytest.mark.slow
def test_every_confirmed_message_survives_a_kill(tmp_path: Path, thorough: bool) -> None:
    rng = random.Random(11)
    died_unfinished = 0
    for attempt in range(100 if thorough else 8):
        folder = tmp_path / str(attempt)
        confirmed = run_and_kill(folder, rng)
        record = read_record(folder)
        assert len(record.jaw.widths) > confirmed, f"attempt {attempt}"
        assert record.joints[0].positions.shape[0] > confirmed
        assert record.depth and record.registration is not None and len(record.attachments) == 3
        died_unfinished += record.stop is None
        saved = salvage(folder)
        if saved is not None:
            again = read_record(folder)
            assert again.stop is not None and again.damage is None
            assert again.jaw.widths.tolist() == record.jaw.widths.tolist()
            assert saved.original.exists()
    assert died_unfinished > 0
