"""CoACD in a process of its own: `python -m reach.world.coacd_process`, arrays in, arrays out.

Its library and Open3D's cannot be loaded into one process in every order (`import open3d` after
`import coacd` fails with std::bad_cast), and a search of a minute must be interruptible.
"""

from __future__ import annotations

import io
import subprocess
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reach.arrays import FloatArray, IntArray
from reach.errors import InvalidMeshError


def run_coacd(
    vertices: FloatArray, faces: IntArray, **options: float
) -> list[tuple[NDArray[Any], NDArray[Any]]]:
    """Decompose a mesh; returns vertices (V, 3) and faces (F, 3) of each convex part.

    Args:
        vertices: shape (V, 3), about unit size.
        faces: shape (F, 3).
        options: of `coacd.run_coacd`.

    Raises:
        InvalidMeshError: CoACD cannot decompose it.
    """
    request = {"vertices": vertices, "faces": faces, **options}
    done = subprocess.run(
        [sys.executable, "-m", "reach.world.coacd_process"],
        input=_packed(request),
        capture_output=True,
        check=False,
    )
    if done.returncode != 0:
        last = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or ["no message"]
        raise InvalidMeshError(f"the mesh cannot be split into convex parts: {last[0]}")
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as answer:
        count = len(answer.files) // 2
        return [(answer[f"vertices{n}"], answer[f"faces{n}"]) for n in range(count)]


def _packed(arrays: dict[str, Any]) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def _serve() -> None:
    """Read a request from standard input, write the parts to standard output."""
    import os

    # CoACD may print to standard output: keep the answer's channel for the answer.
    answer_channel = os.dup(1)
    os.dup2(2, 1)
    import coacd

    coacd.set_log_level("error")
    with np.load(io.BytesIO(sys.stdin.buffer.read()), allow_pickle=False) as request:
        mesh = coacd.Mesh(request["vertices"], request["faces"].astype(np.int32))
        options = {k: request[k].item() for k in request.files if k not in ("vertices", "faces")}
    parts = coacd.run_coacd(mesh, **options)
    answer: dict[str, Any] = {}
    for number, (vertices, faces) in enumerate(parts):
        answer[f"vertices{number}"] = np.asarray(vertices, dtype=float)
        answer[f"faces{number}"] = np.asarray(faces, dtype=np.int64)
    with os.fdopen(answer_channel, "wb") as stream:
        stream.write(_packed(answer))


if __name__ == "__main__":
    _serve()
