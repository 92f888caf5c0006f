"""Compilation is announced if the cache on disk lacks the kernel, by one process, and only then."""

import logging
import os
import time

import pytest

from reach.kernels import compiling


def probe_kernel(x):
    return x + 1.0


def another_kernel(x):
    return x + 2.0


@pytest.fixture
def said(tmp_path, monkeypatch, caplog):
    """What the process said so far, with an empty cache of its own."""
    monkeypatch.setattr(compiling, "_FOLDER", str(tmp_path / "kernels"))
    caplog.set_level(logging.WARNING, logger=compiling.__name__)
    new_process(monkeypatch)
    return lambda: [record.getMessage() for record in caplog.records]


def new_process(monkeypatch):
    monkeypatch.setattr(compiling, "_asked", set())


def call(function):
    kernel = compiling.compiled(function)
    compiling.announce_compilation(kernel)
    return kernel(1.0)


def test_it_is_said_once_and_not_of_kernels_that_the_cache_holds(said, monkeypatch):
    """In the log, not as a Python warning, so that `-W error` does not break the first use."""
    assert call(probe_kernel) == 2.0
    assert said() == [compiling.NOTICE]
    call(probe_kernel)
    (marker,) = (path for path in os.scandir(compiling._FOLDER) if path.is_file())
    os.unlink(marker)
    new_process(monkeypatch)
    assert call(probe_kernel) == 2.0  # loaded
    assert said() == [compiling.NOTICE]


def test_of_processes_that_compile_at_once_one_says_it(said, monkeypatch):
    call(probe_kernel)
    new_process(monkeypatch)
    call(another_kernel)
    assert said() == [compiling.NOTICE]


def test_a_process_that_was_killed_silences_nobody_for_long(said, monkeypatch):
    call(probe_kernel)
    (marker,) = (path for path in os.scandir(compiling._FOLDER) if path.is_file())
    before = time.time() - 2 * compiling.SILENCE
    os.utime(marker, (before, before))
    new_process(monkeypatch)
    call(another_kernel)
    assert said() == [compiling.NOTICE] * 2
