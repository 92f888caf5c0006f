"""How the errors of neighboring depths go together, measured on the table of the same image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from reach.arrays import BoolArray, FloatArray

REACH = 16
"""Errors further apart than this are taken to be independent [pixel]."""
BLOCK = 64
"""Side of the blocks of pixels that are looked at [pixel]."""
MOST_BLOCKS = 48
FEWEST_PAIRS = 2000
"""With fewer pairs of pixels the errors are taken to be independent."""


def autocorrelation(residual: NDArray[np.float32], valid: BoolArray) -> FloatArray:
    """Correlation of the errors of two pixels by their distance along v and u.

    It fades out toward REACH, so that what chance leaves there does not add up.

    Args:
        residual: errors, shape (H, W), in any unit.
        valid: pixels whose error is known, shape (H, W).

    Returns:
        Shape (2 REACH + 1, 2 REACH + 1), 1 in the middle.
    """
    alone = np.zeros((2 * REACH + 1, 2 * REACH + 1))
    alone[REACH, REACH] = 1.0
    blocks = _blocks(residual, valid)
    if blocks is None:
        return alone
    errors, known = blocks
    size = fft.next_fast_len(BLOCK + REACH, real=True)
    products, pairs = _lagged(errors, size), _lagged(known, size)
    middle = pairs[REACH, REACH]
    if middle < FEWEST_PAIRS or products[REACH, REACH] <= 0.0:
        return alone
    covariance = products / np.maximum(pairs, 1.0)
    fade = _fade()
    result: FloatArray = covariance / covariance[REACH, REACH] * fade[:, None] * fade[None, :]
    return result


def variance_of_sum(weights: FloatArray, correlation: FloatArray, stride: int) -> float:
    """Variance of a weighted sum of errors of unit variance that go together.

    Args:
        weights: of every stride-th pixel along v and u, shape (h, w).
        correlation: as `autocorrelation` returns it.
        stride: of the pixels.
    """
    rows, columns = np.nonzero(weights.any(axis=1))[0], np.nonzero(weights.any(axis=0))[0]
    if len(rows) == 0:
        return 0.0
    part = weights[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    far = REACH // stride
    kernel = correlation[REACH % stride :: stride, REACH % stride :: stride]
    shape = [fft.next_fast_len(n + far, real=True) for n in part.shape]
    power = np.abs(fft.rfft2(part, shape)) ** 2
    lagged = fft.irfft2(power, shape)
    lags = np.arange(-far, far + 1)
    return max(0.0, float((lagged[np.ix_(lags % shape[0], lags % shape[1])] * kernel).sum()))


def _blocks(
    residual: NDArray[np.float32], valid: BoolArray
) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
    """The blocks with most valid pixels: errors and validity (N, BLOCK, BLOCK), 0 elsewhere."""
    rows, columns = residual.shape[0] // BLOCK, residual.shape[1] // BLOCK
    if rows == 0 or columns == 0:
        return None
    known = _cut(valid.astype(np.float32), rows, columns)
    errors = _cut(np.where(valid, residual, np.float32(0)), rows, columns)
    order = np.argsort(-known.sum(axis=(1, 2)), kind="stable")[:MOST_BLOCKS]
    return errors[order], known[order]


def _cut(image: NDArray[np.float32], rows: int, columns: int) -> NDArray[np.float32]:
    image = image[: rows * BLOCK, : columns * BLOCK]
    blocks = image.reshape(rows, BLOCK, columns, BLOCK).swapaxes(1, 2)
    return blocks.reshape(-1, BLOCK, BLOCK)


def _lagged(blocks: NDArray[np.float32], size: int) -> FloatArray:
    """Sums over blocks of products of pixels, by their distance up to REACH."""
    power = np.abs(fft.rfft2(blocks, (size, size))) ** 2
    sums = fft.irfft2(power.sum(axis=0, dtype=np.float64), (size, size))
    lags = np.arange(-REACH, REACH + 1)
    result: FloatArray = sums[np.ix_(lags % size, lags % size)]
    return result


def _fade() -> FloatArray:
    """1 up to half of REACH, then falling to 0 beyond it, shape (2 REACH + 1,)."""
    lag = np.abs(np.arange(-REACH, REACH + 1))
    share = np.clip((lag - REACH / 2) / (REACH / 2 + 1), 0.0, 1.0)
    fade: FloatArray = 0.5 * (1.0 + np.cos(np.pi * share))
    return fade
