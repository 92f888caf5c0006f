import numpy as np
import pytest
from scipy import ndimage

from registration.correlation import REACH, autocorrelation, variance_of_sum


def smooth_noise(rng, scale=2.0, shape=(480, 640)):
    """Noise of unit variance whose correlation is exp(-r^2 / (4 scale^2))."""
    white = rng.normal(size=shape)
    return ndimage.gaussian_filter(white, scale, mode="wrap") * 2 * scale * np.sqrt(np.pi)


def test_the_correlation_of_smoothed_noise_is_found():
    noise = 3e-3 * smooth_noise(np.random.default_rng(0)).astype(np.float32)
    found = autocorrelation(noise, np.ones(noise.shape, bool))
    lag = np.arange(-REACH, REACH + 1)
    expected = np.exp(-(lag[:, None] ** 2 + lag[None, :] ** 2) / 16.0)
    np.testing.assert_allclose(found, expected, atol=0.08)
    assert found[REACH, REACH] == pytest.approx(1.0)
    assert found.sum() == pytest.approx(4 * np.pi * 4, rel=0.15)


def test_holes_do_not_bias_the_correlation():
    rng = np.random.default_rng(1)
    noise = smooth_noise(rng).astype(np.float32)
    valid = rng.random(noise.shape) < 0.7
    whole = autocorrelation(noise, np.ones(noise.shape, bool))
    pierced = autocorrelation(np.where(valid, noise, np.float32(np.nan)), valid)
    np.testing.assert_allclose(pierced, whole, atol=0.05)


@pytest.mark.parametrize("shape", [(40, 50), (480, 640)])
def test_too_few_pixels_are_taken_to_be_independent(shape):
    valid = np.zeros(shape, bool)
    valid[:20, :20] = True
    found = autocorrelation(np.ones(shape, np.float32), valid)
    assert found.sum() == 1.0 and found[REACH, REACH] == 1.0


@pytest.mark.parametrize("stride", [1, 2, 3])
def test_the_variance_of_a_sum_is_that_of_many_draws(stride):
    rng = np.random.default_rng(2)
    lag = np.arange(-REACH, REACH + 1)
    correlation = np.exp(-(lag[:, None] ** 2 + lag[None, :] ** 2) / 16.0)
    weights = np.zeros((30, 40))
    weights[4:14, 10:30] = rng.normal(size=(10, 20)) + 0.5
    sums = []
    for _ in range(300):
        noise = smooth_noise(rng, shape=(30 * stride, 40 * stride))
        sums.append((noise[::stride, ::stride] * weights).sum())
    assert variance_of_sum(weights, correlation, stride) == pytest.approx(np.var(sums), rel=0.3)
    assert variance_of_sum(np.zeros((5, 5)), correlation, stride) == 0.0
