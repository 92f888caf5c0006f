"""Errors of depths that go together, undone: what a difference tells against such errors."""

from __future__ import annotations

import numpy as np
from scipy import fft

from reach.arrays import BoolArray, FloatArray
from registration.correlation import REACH


class ErrorModel:
    """Covariance of the errors of an image's pixels: shared as on the table, and each by itself.

    Args:
        correlation: as `registration.correlation.autocorrelation` returns it.
        stride: of the pixels.
        variance: of a depth on the table [m^2].
        own: further variance of each pixel by itself, shape (h, w) [m^2].
        known: pixels that say something, shape (h, w).
    """

    def __init__(
        self,
        correlation: FloatArray,
        stride: int,
        *,
        variance: float,
        own: FloatArray,
        known: BoolArray,
    ) -> None:
        far = REACH // stride
        self._shape = known.shape
        self._padded = [fft.next_fast_len(n + far, real=True) for n in known.shape]
        kernel = np.zeros(self._padded)
        lags = np.arange(-far, far + 1)
        rows, columns = np.ix_(lags % self._padded[0], lags % self._padded[1])
        kernel[rows, columns] = correlation[REACH % stride :: stride, REACH % stride :: stride]
        self._power = variance * np.maximum(fft.rfft2(kernel).real, 0.0)
        self._own, self._known = own, known
        self._scale = 1.0 / (variance + own)

    def times(self, images: FloatArray) -> FloatArray:
        """The covariance times images (..., h, w)."""
        spread = fft.irfft2(fft.rfft2(images, self._padded) * self._power, self._padded)
        spread = spread[..., : self._shape[0], : self._shape[1]]
        return np.where(self._known, spread + self._own * images, 0.0)

    def undone(self, images: FloatArray, steps: int) -> FloatArray:
        """The inverse covariance times images (N, h, w), nearly, by conjugate gradients."""
        result = np.zeros_like(images)
        left = np.where(self._known, images, 0.0)
        way = left * self._scale
        power = _dot(left, way)
        for _ in range(steps):
            moved = self.times(way)
            length = power / np.maximum(_dot(way, moved), 1e-300)
            result += length * way
            left -= length * moved
            scaled = left * self._scale
            before, power = power, _dot(left, scaled)
            way = scaled + power / np.maximum(before, 1e-300) * way
        return result


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Scalar products (N, 1, 1) of images (N, h, w), without BLAS."""
    product: FloatArray = (a * b).sum(axis=(1, 2), keepdims=True)
    return product
