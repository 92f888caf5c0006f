"""The digest of the code: the same wherever it lies, another one after any change."""

from pathlib import Path

import pytest

import reach
from reach.sources import source_digest


def package(folder: Path, **changes: str) -> Path:
    files = {"model.py": "FRICTION = 0.5\n", "kernels/press.py": "DEPTH = 1\n", "note.txt": "a"}
    for name, text in (files | changes).items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


def test_two_checkouts_of_the_same_code_agree(tmp_path):
    one, two = package(tmp_path / "one"), package(tmp_path / "two", **{"note.txt": "b"})
    assert source_digest(one) == source_digest(two)


@pytest.mark.parametrize(
    "changes",
    [
        {"model.py": "FRICTION = 0.6\n"},
        {"kernels/press.py": "DEPTH = 2\n"},
        {"kernels/new.py": ""},
        {"model.py": "FRICTION = 0.5\nDEPTH = 1\n", "kernels/press.py": ""},
    ],
    ids=["a file", "a file in a folder", "one more", "a line moved"],
)
def test_any_change_of_the_code_changes_it(tmp_path, changes):
    before = package(tmp_path / "before")
    assert source_digest(before) != source_digest(package(tmp_path / "after", **changes))


def test_by_default_it_is_that_of_the_whole_package():
    assert source_digest() == source_digest(Path(reach.__file__).parent)
