"""Impulse responses of all pixels: the light of a scene at the camera.

Brightness is relative to a white surface that faces the light at 1 m; the sensor's exposure
turns it into digital numbers.
"""

import math
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import Response

Moments = NDArray[np.complex64 | np.float32]
"""In single precision; at 0 Hz they are real numbers."""


class Responses(Protocol):
    """Impulse responses g(tau) of H x W pixels."""

    @property
    def kind(self) -> Literal["sparse", "dense"]:
        """Whether ``of_pixel`` gives returns or a density."""
        ...

    def moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        """``int g(tau) exp(2 pi i f tau) dtau`` of each pixel, (H, W)."""
        ...

    def returns(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Delays in s, NaN where absent, and weights, 0 where absent: (K, H, W), by delay."""
        ...

    def of_pixel(self, x: int, y: int) -> Response:
        """Return times in s with weights (sparse), or with the density per s (dense)."""
        ...


@dataclass(frozen=True, slots=True)
class Scatter:
    """An exponentially modified Gaussian: the return of light that enters a material.

    The convolution of a normal density of standard deviation ``width_s`` with an exponential one
    of mean ``decay_s`` (after Heide et al. 2014, as the paper's Fig. 11). Numbers, or arrays with
    one for each pixel, 0 where light does not enter the surface.
    """

    width_s: Any
    decay_s: Any

    def transfer(self, frequency_hz: float) -> Any:
        """``int g(t) exp(2 pi i f t) dt``, the factor of moments."""
        omega = 2 * np.pi * frequency_hz
        return np.exp(-0.5 * (omega * self.width_s) ** 2) / (1 - 1j * omega * self.decay_s)

    def reshaped(self, shape: tuple[int, ...]) -> "Scatter":
        """Return the same in another shape."""
        return Scatter(np.reshape(self.width_s, shape), np.reshape(self.decay_s, shape))

    def cumulated(self, time_s: NDArray[Any]) -> NDArray[np.float64]:
        """Share of the light that is back at these times after the sharp return."""
        if not self.width_s and not self.decay_s:
            return (time_s >= 0).astype(np.float64)
        if not self.decay_s:
            return _normal_share(time_s / self.width_s)
        if not self.width_s:
            return np.where(time_s < 0, 0.0, -np.expm1(-np.maximum(time_s, 0) / self.decay_s))
        v = self.width_s / self.decay_s
        u = time_s / self.width_s
        decayed = np.exp(np.minimum(0.5 * v * v - v * u, 700)) * _normal_share(u - v)
        # far before the return the product above is 0 times infinity
        return np.where(u < -8, 0.0, np.clip(_normal_share(u) - decayed, 0, 1))


def _normal_share(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cumulative standard normal distribution."""
    return np.array([0.5 * math.erfc(-value / math.sqrt(2)) for value in np.ravel(x)]).reshape(
        np.shape(x)
    )


class SparseResponses:
    """A few returns a pixel: sharp ones, or widened by the material they come from.

    ``delay_s``, ``weight``: (K, H, W) in any order; a weight of 0 means absent.
    ``scatter``: width of the returns: (H, W) of all of a pixel, or (K, H, W) of each.
    """

    def __init__(
        self,
        delay_s: NDArray[np.float64],
        weight: NDArray[np.float64],
        scatter: Scatter | None = None,
    ) -> None:
        delay_s = np.where(weight > 0, delay_s, np.nan)
        order = np.argsort(delay_s, axis=0)  # NaN goes last
        self._delay_s = np.take_along_axis(delay_s, order, axis=0)
        self._weight = np.take_along_axis(weight, order, axis=0)
        self._scatter = scatter
        if scatter is not None:
            planes = (np.broadcast_to(p, weight.shape) for p in (scatter.width_s, scatter.decay_s))
            self._scatter = Scatter(*(np.take_along_axis(p, order, axis=0) for p in planes))

    @property
    def kind(self) -> Literal["sparse", "dense"]:
        """Sparse, unless a material widens returns."""
        return "sparse" if self._scatter is None else "dense"

    def moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        """Sum of the returns' phasors."""
        phase_rad = 2 * np.pi * frequency_hz * np.nan_to_num(self._delay_s)
        phasors = self._weight * np.exp(1j * phase_rad)
        if self._scatter is not None:
            phasors *= self._scatter.transfer(frequency_hz)
        moments: NDArray[np.complex128] = np.sum(phasors, axis=0)
        return moments

    def returns(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the returns themselves."""
        return self._delay_s, self._weight

    def of_pixel(self, x: int, y: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Delays and weights of the pixel's returns, or their density over equal bins."""
        there = self._weight[:, y, x] > 0
        delay_s, weight = self._delay_s[there, y, x], self._weight[there, y, x]
        if self._scatter is None:
            return delay_s, weight
        width_s, decay_s = self._scatter.width_s[there, y, x], self._scatter.decay_s[there, y, x]
        edges_s = bin_edges(delay_s, tail_s=float(np.max(8 * width_s + 12 * decay_s, initial=0.0)))
        mass = np.zeros(len(edges_s) - 1)
        for at_s, of, width, decay in zip(delay_s, weight, width_s, decay_s, strict=True):
            mass += of * np.diff(Scatter(width, decay).cumulated(edges_s - at_s))
        time_s: NDArray[np.float64] = np.asarray(edges_s[:-1] + BIN_S / 2, dtype=np.float64)
        return time_s, np.asarray(mass / BIN_S, dtype=np.float64)


BIN_S = 5e-11
"""Width of the bins of computed densities; those from files have their own."""


def bin_edges(delay_s: NDArray[np.float64], *, tail_s: float) -> NDArray[np.float64]:
    """Edges of equal bins around returns, one of which is centred at the first return."""
    first = float(delay_s.min()) if delay_s.size else 0.0
    last = float(delay_s.max()) if delay_s.size else 0.0
    before, after = math.ceil(tail_s / BIN_S), math.ceil((last - first + tail_s) / BIN_S)
    return np.asarray(first + BIN_S * (np.arange(-before, after + 2) - 0.5), dtype=np.float64)
