"""Scores of grasps kept on disk, found again by content.

One append-only file per model, parameters, pose error and seed; a line a grasp. A process that
is killed leaves at worst one torn line, which is skipped, so that an interrupted evaluation
goes on where it stopped. The folder may be deleted at any time.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
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
    """

    def __init__(self, model_key: str) -> None:
        self._path = cache_folder() / "scores" / f"{model_key}.jsonl"
        self._known: dict[str, float] = {}
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
            digest, value = json.loads(line)
            if isinstance(digest, str) and 0.0 <= float(value) <= 1.0:
                self._known[digest] = float(value)
        except (ValueError, TypeError):
            return  # a torn line costs one score

    def get(self, digest: str) -> float | None:
        """The score of a grasp, or None if it is not known."""
        return self._known.get(digest)

    def put(self, digest: str, value: float) -> None:
        """Keep a score. A full or read-only disk costs time later, never a result."""
        self._known[digest] = value
        line = json.dumps([digest, value]) + "\n"
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
