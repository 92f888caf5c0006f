"""Read-only arrays: the vocabulary's values never change after they are made."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reach.errors import InvalidInputError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def frozen(value: ArrayLike, dtype: Any = np.float64) -> NDArray[Any]:
    """Copy a value into a contiguous array that cannot be written to."""
    array = np.array(value, dtype=dtype, order="C", copy=True)
    array.setflags(write=False)
    return array


def frozen_finite(value: ArrayLike, name: str, shape: tuple[int, ...]) -> FloatArray:
    """Copy a value into a read-only float array of a given shape, refusing NaN and infinity.

    Args:
        value: anything numpy reads as an array.
        name: what the value is, for the error message.
        shape: the expected shape; -1 matches any length.

    Raises:
        InvalidInputError: if the shape differs or an entry is not finite.
    """
    try:
        array = frozen(value)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"{name} is not an array of numbers: {error}") from error
    fits = array.ndim == len(shape) and all(
        want in (-1, have) for want, have in zip(shape, array.shape, strict=True)
    )
    if not fits:
        raise InvalidInputError(f"{name} has shape {array.shape}, expected {shape}")
    if not np.all(np.isfinite(array)):
        raise InvalidInputError(f"{name} holds a value that is not finite: {array.ravel()[:16]}")
    return array


def positive(value: float, name: str, *, zero_allowed: bool = False) -> float:
    """Return a finite positive number as float.

    Raises:
        InvalidInputError: if it is no number, negative, not finite, or zero where zero is not allowed.
    """
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = np.nan
    if not np.isfinite(number) or number < 0 or (number == 0 and not zero_allowed):
        bound = ">= 0" if zero_allowed else "> 0"
        raise InvalidInputError(f"{name} is {value!r}, expected a finite number {bound}")
    return number
