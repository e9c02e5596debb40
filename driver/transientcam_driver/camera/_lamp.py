"""The lamp of a camera: where it stands, and how bright it makes a white surface."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Lamp:
    """A small lamp, in the coordinates of the camera: x right, y down, z forward.

    Attributes
    ----------
    position_m, axis
        Where it stands, and the unit vector along which its beam is brightest.
    beam_exponent
        Its intensity falls with this power of the cosine to the axis.
    dn_per_s
        Brightness, for each second of exposure, of a white matt surface that faces it at 1 m.
    """

    position_m: tuple[float, float, float]
    axis: tuple[float, float, float]
    beam_exponent: float
    dn_per_s: float

    def white_dn_per_s(self, points_m: NDArray[Any]) -> NDArray[np.float64]:
        """Return the brightness (...) of white surfaces at points (3, ...) that face the lamp."""
        way = np.moveaxis(np.asarray(points_m, dtype=np.float64), 0, -1) - self.position_m
        square = np.einsum("...c,...c->...", way, way)
        with np.errstate(divide="ignore", invalid="ignore"):  # at the lamp itself, and nowhere
            cosine = np.maximum(way @ self.axis / np.sqrt(square), 0.0)
            white: NDArray[np.float64] = self.dn_per_s * cosine**self.beam_exponent / square
        return white
