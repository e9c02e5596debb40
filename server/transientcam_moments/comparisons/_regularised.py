"""A linear inverse problem over a whole image, with priors along time and between neighbours."""

from typing import Any

import numpy as np

from transientcam_moments.arrays import Array, in_range
from transientcam_moments.comparisons._estimate import GridEstimate, Real, grid_rad
from transientcam_moments.comparisons._pixels import Pixels, pixels_of
from transientcam_moments.comparisons._technique import TEXTS, Technique, from_first
from transientcam_moments.errors import ParameterError

BINS = 64
_LEAST = 1
_BRIGHTNESS = 1e-3  # decides on what neither data nor priors see: a uniform part


def regularised(
    b: Array,
    *,
    temporal: float = 1e-3,
    spatial: float = 3e-3,
    delta: float = 0.02,
    bins: int = BINS,
    iterations: int = 200,
) -> GridEstimate:
    """Estimate densities that come close to the moments and vary little.

    b_0 is not looked at. Only moments (m + 1, H, W) have neighbouring pixels.

    Parameters
    ----------
    temporal, spatial : float
        Weights of the priors, >= 0.
    delta : float
        Differences of light below it, relative to the image's median, are punished by their
        squares, larger ones by their size; > 0.
    bins : int
        Of phase, more than 2 m.
    iterations : int
        Most steps of the solver.

    Notes
    -----
    min |Phi x - v|^2 / 2 + temporal sum H(D_t x) + spatial sum H(D_yx x) + a little sum x over
    x >= 0, with Huber's H, for all pixels at once by SciPy's L-BFGS-B. The constraint by the
    measurement is soft, other than in the paper's own estimates.
    """
    for field, weight in (("temporal", temporal), ("spatial", spatial)):
        in_range(field, weight, 0.0, float(np.finfo(float).max), ">= 0 and finite")
    in_range("delta", delta, 1e-12, float(np.finfo(float).max), "> 0")
    if iterations < 1:
        raise ParameterError("iterations", iterations, ">= 1")
    pixels = pixels_of(b, least=_LEAST, name="regularised")
    pixels.require_bins(bins)
    image = len(pixels.trailing) == 2
    problem = Problem(pixels, temporal, spatial if image else 0.0, delta, bins)
    light = problem.solve(iterations) * problem.per_pixel
    return pixels.grid(light * (bins / (2 * np.pi)))


class Problem:
    """What is minimised, over the light x (bins, P) of pixels in the unit of the image's median."""

    def __init__(
        self, pixels: Pixels, temporal: float, spatial: float, delta: float, bins: int
    ) -> None:
        usable = pixels.usable
        median = float(np.median(pixels.scale[usable])) if usable.any() else 1.0
        unit = np.where(usable, pixels.scale / median, 0)
        with np.errstate(divide="ignore"):
            self.per_pixel = np.where(unit > 0, 1 / unit, 0)
        parts = np.concatenate([pixels.b[1:].real, pixels.b[1:].imag])
        self.v = np.where(usable, parts * unit, 0)
        angles = np.outer(np.arange(1, pixels.m + 1), grid_rad(bins))
        self.phi = np.concatenate([np.cos(angles), np.sin(angles)])
        self.temporal, self.spatial, self.delta = temporal, spatial, delta
        self.usable = usable
        self._image = (bins, *pixels.trailing)

    def solve(self, iterations: int) -> Real:
        """Return the light (bins, P)."""
        from scipy.optimize import minimize  # heavy, and not needed by those who don't compare

        shape = (self.phi.shape[1], self.v.shape[1])
        # where the squares alone would lead, as far as it is positive
        start = np.maximum(self.phi.T @ self.v * (2 / shape[0]), 0)

        def cost(flat: Real) -> tuple[float, Real]:
            value, slope = self.cost(flat.reshape(shape))
            return value, slope.ravel()

        found: Any = minimize(
            cost,
            start.ravel(),
            jac=True,
            method="L-BFGS-B",
            bounds=[(0.0, None)] * start.size,
            options={"maxiter": iterations, "maxfun": 2 * iterations, "ftol": 1e-12, "gtol": 1e-9},
        )
        light: Real = found.x.reshape(shape)
        return light

    def cost(self, x: Real) -> tuple[float, Real]:
        """Return the cost of light (bins, P) and its gradient."""
        residual = self.phi @ x - self.v  # light in an unusable pixel explains nothing, and goes
        value = 0.5 * float((residual**2).sum()) + _BRIGHTNESS * float(x.sum())
        slope = self.phi.T @ residual + _BRIGHTNESS
        if self.temporal:
            steps = np.roll(x, -1, axis=0) - x
            height, tilt = _huber(steps, self.delta)
            value += self.temporal * height
            slope += self.temporal * (np.roll(tilt, 1, axis=0) - tilt)
        if self.spatial:
            image, known = x.reshape(self._image), self.usable.reshape(self._image[1:])
            slopes = slope.reshape(self._image)
            for axis in (1, 2):
                here, there = _neighbours(3, axis)
                both = known[here[1:]] & known[there[1:]]
                steps = np.where(both, image[there] - image[here], 0)
                height, tilt = _huber(steps, self.delta)
                value += self.spatial * height
                slopes[there] += self.spatial * tilt
                slopes[here] -= self.spatial * tilt
        return value, slope


def _huber(steps: Real, delta: float) -> tuple[float, Real]:
    """Return the sum of Huber's function, steep as 1 beyond delta, and its derivative."""
    tilt = np.clip(steps / delta, -1, 1)
    return float((tilt * (steps - 0.5 * delta * tilt)).sum()), tilt


def _neighbours(axes: int, axis: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    here, there = [slice(None)] * axes, [slice(None)] * axes
    here[axis], there[axis] = slice(None, -1), slice(1, None)
    return tuple(here), tuple(there)


TECHNIQUE = Technique(
    **TEXTS["regularised"],
    harmonics=from_first,
    least_harmonics=_LEAST,
    estimate=regularised,
    planar=False,
)
