"""The made-up trial and session that record tests share."""

import importlib.util
import os
from pathlib import Path
from types import ModuleType

import pytest

FIXTURES = Path(__file__).parent / "fixtures"


def _load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, FIXTURES / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def made() -> ModuleType:
    """A made-up trial: `fixtures/sample_trial.py`."""
    return _load("sample_trial")


@pytest.fixture(scope="session")
def sessions() -> ModuleType:
    """Made-up sessions: `fixtures/sample_session.py`."""
    return _load("sample_session")


@pytest.fixture(scope="session")
def fixtures() -> Path:
    """Folder of checked-in files."""
    return FIXTURES


@pytest.fixture(scope="session")
def thorough() -> bool:
    """Whether kill tests run in full number."""
    return os.environ.get("REACH_SLOW") == "1"
