"""Scores of grasps kept on disk, found again by content.

One append-only file per model, parameters (or sets of them), pose error and seed; a line a grasp. A
process that is killed leaves at worst one torn line, which is skipped, so that an interrupted
evaluation goes on where it stopped. The folder may be deleted at any time.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from reach.cache import cache_folder, cache_key
from reach.grasp import Grasp
from reach.gripper import ParallelJawGripper
from reach.scene import Scene


@lru_cache(maxsize=8)
def gripper_digest(gripper: ParallelJawGripper) -> str:
    """Digest of everything that a gripper is made of."""
    return hashlib.sha256(repr(_plain(gripper)).encode()).hexdigest()


def grasp_digest(scene: Scene, grasp: Grasp) -> str:
    """Digest of all a score depends on besides model, pose error and seed."""
    part = scene.object
    return cache_key(
        part.content_hash,
        part.mass,
        part.com.tobytes(),
        gripper_digest(scene.gripper),
        scene.T_world_object.tobytes(),
        scene.table_height,
        grasp.T_object_gripper.tobytes(),
        grasp.opening,
        grasp.force,
    )


class ScoreCache:
    """Scores of one model under fixed parameters, pose error and seed.

    Args:
        model_key: digest of those.
        width: scores a grasp: one, or one for each of several parameter sets.
    """

    def __init__(self, model_key: str, width: int = 1) -> None:
        self._path = cache_folder() / "scores" / f"{model_key}.jsonl"
        self._width = width
        self._known: dict[str, tuple[float, ...]] = {}
        self._torn = False
        try:
            text = self._path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError):
            return
        self._torn = bool(text) and not text.endswith("\n")
        for line in text.splitlines():
            self._read(line)

    def _read(self, line: str) -> None:
        try:
            digest, *values = json.loads(line)
            scores = tuple(float(value) for value in values)
            inside = all(0.0 <= score <= 1.0 for score in scores)
            if isinstance(digest, str) and inside and len(scores) == self._width:
                self._known[digest] = scores
        except (ValueError, TypeError):
            return  # a torn line costs one score

    def get(self, digest: str) -> tuple[float, ...] | None:
        """The scores of a grasp, or None if they are not known."""
        return self._known.get(digest)

    def put(self, digest: str, scores: Sequence[float]) -> None:
        """Keep scores. A full or read-only disk costs time later, never a result."""
        self._known[digest] = tuple(scores)
        line = json.dumps([digest, *scores]) + "\n"
        if self._torn:
            line, self._torn = "\n" + line, False
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            handle = os.open(self._path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
            try:
                os.write(handle, line.encode())
            finally:
                os.close(handle)
        except OSError:
            return


def _plain(value: object) -> object:
    """Nested tuples of a dataclass of arrays, for a digest that is the same everywhere."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = dataclasses.fields(value)
        return tuple((field.name, _plain(getattr(value, field.name))) for field in fields)
    if isinstance(value, tuple):
        return tuple(_plain(item) for item in value)
    if isinstance(value, np.ndarray):
        return (value.shape, value.tolist())
    return value
