"""Which code computed a value: a digest of source files, for keys of caches and for records.

A version number written by hand is forgotten when a helper of a helper changes; a digest is not.
"""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

DIGITS = 16


@lru_cache(maxsize=8)
def source_digest(folder: Path = Path(__file__).parent) -> str:
    """Digest of all Python sources in and below a folder: by default all that scores depend on.

    Read once a process: whoever edits the code while it runs still runs what was there before.

    Args:
        folder: of a package.

    Returns:
        Hexadecimal digits.
    """
    digest = hashlib.sha256()
    for source in sorted(folder.rglob("*.py")):
        digest.update(source.relative_to(folder).as_posix().encode() + b"\0")
        digest.update(source.read_bytes() + b"\0")
    return digest.hexdigest()[:DIGITS]
