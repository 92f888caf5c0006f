"""What two kinds of depth sensor do to a perfect depth image.

Structured light: fine noise, shadows where the projector does not reach, dropouts at grazing
angles. Stereo: noise that is correlated over a matching window and grows with the square of the
depth, flying pixels and holes at depth edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from reach.arrays import BoolArray, FloatArray


@dataclass(frozen=True, slots=True)
class SensorModel:
    """The numbers of one kind of sensor.

    Args:
        width: default image width [pixel].
        height: default image height [pixel].
        pitch: distance of neighboring pixels on a surface at the working distance [m].
        baseline: from the camera to the projector or second camera, along camera x [m].
        noise: standard deviation of the depth at the working distance, facing [m].
        correlation: standard deviation of the noise's Gaussian window [pixel]; 0 is white.
        grazing_limit: least cosine of the angle of incidence that is measured.
        dropout: share of pixels lost for no visible reason.
        edge: depth step that counts as an edge [m].
        edge_loss: share of edge pixels without return.
        flying: share of edge pixels that float between front and back.
    """

    width: int
    height: int
    pitch: float
    baseline: float
    noise: float
    correlation: float
    grazing_limit: float
    dropout: float
    edge: float
    edge_loss: float
    flying: float


SENSOR_MODELS = {
    "structured-light": SensorModel(
        width=640, height=480, pitch=0.35e-3, baseline=0.15, noise=0.15e-3, correlation=0.0,
        grazing_limit=0.15, dropout=0.005, edge=2e-3, edge_loss=0.5, flying=0.0,
    ),
    "stereo": SensorModel(
        width=424, height=320, pitch=0.7e-3, baseline=0.05, noise=1.5e-3, correlation=2.5,
        grazing_limit=0.10, dropout=0.01, edge=8e-3, edge_loss=0.35, flying=0.3,
    ),
}  # fmt: skip


def spoil(
    depth: FloatArray,
    incidence: FloatArray,
    shadow: BoolArray,
    model: SensorModel,
    working_distance: float,
    rng: np.random.Generator,
) -> FloatArray:
    """Turn a perfect depth image into what the sensor would say.

    Args:
        depth: true depth, NaN where nothing is hit, shape (H, W) [m].
        incidence: cosine between surface normal and ray, shape (H, W).
        shadow: where the second eye does not see the point, shape (H, W).
        model: of the sensor.
        working_distance: at which the noise is specified [m].
        rng: source of the noise.
    """
    scale = model.noise * (depth / working_distance) ** 2 / np.sqrt(np.clip(incidence, 0.1, 1.0))
    spoiled = depth + scale * _noise_field(depth.shape, model.correlation, rng)
    edge = depth_edges(depth, model.edge)
    spoiled = _with_flying_pixels(spoiled, edge, model, rng)
    lost = shadow | (incidence < model.grazing_limit)
    lost |= rng.random(depth.shape) < model.dropout
    lost |= edge & (rng.random(depth.shape) < model.edge_loss)
    spoiled[lost] = np.nan
    return spoiled


def depth_edges(depth: FloatArray, step: float) -> BoolArray:
    """Pixels whose 3x3 neighborhood spans more than a depth step [m]."""
    filled = np.where(np.isnan(depth), np.inf, depth)
    lowest = ndimage.minimum_filter(filled, 3)
    highest = ndimage.maximum_filter(np.where(np.isinf(filled), -np.inf, filled), 3)
    edges: BoolArray = np.isfinite(depth) & (highest - lowest > step)
    return edges


def _noise_field(
    shape: tuple[int, ...], correlation: float, rng: np.random.Generator
) -> FloatArray:
    """Gaussian noise of unit variance, correlated over a window [pixel]."""
    white = rng.standard_normal(shape)
    if correlation <= 0:
        return white
    smooth = ndimage.gaussian_filter(white, correlation, mode="wrap")
    # The variance that a Gaussian window leaves of white noise is 1 / (4 pi sigma^2).
    field: FloatArray = smooth * (2.0 * np.sqrt(np.pi) * correlation)
    return field


def _with_flying_pixels(
    depth: FloatArray, edge: BoolArray, model: SensorModel, rng: np.random.Generator
) -> FloatArray:
    flying = edge & (rng.random(depth.shape) < model.flying)
    if not flying.any():
        return depth
    filled = np.where(np.isnan(depth), np.nanmax(depth), depth)
    front, back = ndimage.minimum_filter(filled, 3), ndimage.maximum_filter(filled, 3)
    share = rng.random(depth.shape)
    return np.where(flying, front + share * (back - front), depth)
