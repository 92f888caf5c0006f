"""Generate the protobuf modules: `python -m logs.schema.generate`.

Needs the `dev` extra (grpcio-tools and mypy-protobuf); the generated files are checked in, so
that users need neither.
"""

from __future__ import annotations

import sys
from pathlib import Path

SCHEMA_FOLDER = Path(__file__).parent
SOURCES = ("trial_v1.proto",)


def generate(out: Path) -> list[Path]:
    """Compile every schema source into a folder.

    Returns:
        The generated files: a module and a stub for each source.

    Raises:
        RuntimeError: if the compiler refuses a source.
    """
    from importlib.resources import files

    from grpc_tools import protoc

    well_known = files("grpc_tools") / "_proto"
    arguments = ["protoc", f"-I{SCHEMA_FOLDER}", f"-I{well_known}"]
    plugin = Path(sys.executable).parent / "protoc-gen-mypy"
    arguments += [f"--plugin=protoc-gen-mypy={plugin}", f"--python_out={out}", f"--mypy_out={out}"]
    if protoc.main([*arguments, *SOURCES]) != 0:
        raise RuntimeError(f"protoc refused one of {', '.join(SOURCES)}")
    return sorted(out.glob("*_pb2.py")) + sorted(out.glob("*_pb2.pyi"))


if __name__ == "__main__":
    for path in generate(SCHEMA_FOLDER):
        print(path.name)
