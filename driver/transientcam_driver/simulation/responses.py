"""Impulse responses of all pixels: what a scene is for the camera.

Brightness is relative to a white surface that faces the light at 1 m; the sensor's exposure
turns it into digital numbers.
"""

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S


class Responses(Protocol):
    """Impulse responses g(tau) of H x W pixels."""

    kind: Literal["sparse", "dense"]

    def moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        """``int g(tau) exp(2 pi i f tau) dtau`` of each pixel, (H, W)."""
        ...

    def returns(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Delays in s, NaN where absent, and weights, 0 where absent: (K, H, W), by delay."""
        ...

    def of_pixel(self, x: int, y: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return times in s with weights (sparse), or with the density per s (dense)."""
        ...


class SparseResponses:
    """A few sharp returns a pixel.

    Parameters
    ----------
    delay_s, weight
        (K, H, W) in any order; a weight of 0 means absent.
    """

    kind: Literal["sparse", "dense"] = "sparse"

    def __init__(self, delay_s: NDArray[np.float64], weight: NDArray[np.float64]) -> None:
        delay_s = np.where(weight > 0, delay_s, np.nan)
        order = np.argsort(delay_s, axis=0)  # NaN goes last
        self._delay_s = np.take_along_axis(delay_s, order, axis=0)
        self._weight = np.take_along_axis(weight, order, axis=0)

    def moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        """Sum of the returns' phasors."""
        phase_rad = 2 * np.pi * frequency_hz * np.nan_to_num(self._delay_s)
        moments: NDArray[np.complex128] = np.sum(self._weight * np.exp(1j * phase_rad), axis=0)
        return moments

    def returns(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the returns themselves."""
        return self._delay_s, self._weight

    def of_pixel(self, x: int, y: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Delays and weights of the returns that are there."""
        there = self._weight[:, y, x] > 0
        return self._delay_s[there, y, x], self._weight[there, y, x]


@dataclass(frozen=True)
class Truth:
    """What is really there, in the units of what is measured.

    Attributes
    ----------
    delay_s
        (K, H, W) of each return, by delay; NaN where there is none.
    weight
        (K, H, W) in DN at the exposure set; 0 where there is none.
    kind
        "sparse": the returns are all there is. "dense": they sum up continuous responses, each
        by its first peak and its mass.
    """

    delay_s: NDArray[np.float64]
    weight: NDArray[np.float64]
    kind: Literal["sparse", "dense"]
    _responses: Responses
    _scale_dn: float

    @property
    def range_m(self) -> NDArray[np.float64]:
        """(H, W): half the way of the first return; NaN where no light comes back."""
        range_m: NDArray[np.float64] = SPEED_OF_LIGHT_M_S * self.delay_s[0] / 2
        return range_m

    @property
    def direct(self) -> NDArray[np.float64]:
        """(H, W): weight of the first return, in DN."""
        direct: NDArray[np.float64] = self.weight[0]
        return direct

    @property
    def brightness(self) -> NDArray[np.float64]:
        """(H, W): all light that comes back, in DN."""
        total: NDArray[np.float64] = self.weight.sum(axis=0)
        return total

    def impulse_response(self, x: int, y: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return a pixel's times in s, with weights in DN (sparse) or a density in DN/s (dense)."""
        time_s, value = self._responses.of_pixel(x, y)
        return time_s, value * self._scale_dn
