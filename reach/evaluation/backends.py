"""Where scores are computed when one process is not enough."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from reach.errors import InvalidInputError


@contextmanager
def cluster(backend: str, scheduler: str | None) -> Iterator[None]:
    """Connect to a Dask cluster for the time of a block, if that is the backend.

    Args:
        backend: of [BACKENDS][reach.evaluation.scoring.BACKENDS].
        scheduler: address of a running scheduler; None takes `DASK_SCHEDULER_ADDRESS`, else
            starts workers on this machine.

    Raises:
        InvalidInputError: a scheduler is given to another backend or cannot be reached, or the
            extra `cluster` is not installed.
    """
    if backend != "dask":
        if scheduler is not None:
            raise InvalidInputError(f"--scheduler {scheduler} is for --backend dask, not {backend}")
        yield
        return
    try:
        from distributed import Client
    except ImportError as error:
        raise InvalidInputError(
            "--backend dask needs the extra 'cluster': pip install 'reach-trials[cluster]'"
        ) from error
    try:
        client = Client(scheduler) if scheduler else Client()
    except (OSError, TimeoutError, ValueError) as error:
        raise InvalidInputError(f"no Dask scheduler answers at {scheduler}: {error}") from error
    with client:
        yield
