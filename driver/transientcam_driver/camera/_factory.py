"""What a camera reports about itself: gains of its pixels, its lens, its lamp."""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera._sensor import Sensor

_Array = NDArray[Any]
_STEPS: Final = 30
_CLOSE: Final = 1e-12


@dataclass(frozen=True, slots=True)
class Lens:
    """A pinhole camera with the distortion of Brown and Conrady, and where its light stands.

    A point at (x, y, 1) is seen at the pixel (fx xd + cx, fy yd + cy); whole numbers are the
    centres of pixels, x points right and y down. With r^2 = x^2 + y^2, xd is
    x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2), and yd likewise.

    Attributes
    ----------
    fx, fy, cx, cy
        Focal lengths and principal point, in pixels.
    distortion
        (k1, k2, p1, p2, k3), the order of OpenCV; empty without any.
    light_x_m, light_y_m, light_z_m
        Where the light is: right of the lens, below it, and before it.
    beam
        ``axis``, ``beam_exponent`` and ``dn_per_s`` of `Lamp`, five numbers; empty if not known.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()
    light_x_m: float = 0.0
    light_y_m: float = 0.0
    light_z_m: float = 0.0
    beam: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what no lens has (ValueError)."""
        values = self.fx, self.fy, self.cx, self.cy, *self.distortion, *self.light_m, *self.beam
        if not all(map(math.isfinite, values)) or min(self.fx, self.fy) <= 0:
            raise ValueError(f"{self} is no lens: focal lengths are above 0, and all are finite")
        if len(self.distortion) not in (0, 5):
            raise ValueError(f"distortion has 5 coefficients or none, not {len(self.distortion)}")
        if len(self.beam) not in (0, 5):
            raise ValueError(f"beam has 5 numbers or none, not {len(self.beam)}")

    @property
    def light_m(self) -> tuple[float, float, float]:
        """Where the light is, x, y and z."""
        return self.light_x_m, self.light_y_m, self.light_z_m

    @property
    def lamp(self) -> "Lamp | None":
        """The light; None where its beam is not known."""
        return Lamp(self.light_m, self.beam[:3], *self.beam[3:]) if self.beam else None

    def slopes(self, width: int, height: int) -> tuple[_Array, _Array]:
        """Return x and y (H, W) of the rays (x, y, 1) of all pixels, without distortion.

        By Newton's method in two dimensions. NaN where distortion folds the image back, so that
        there is no ray.
        """
        xd, yd = np.meshgrid(
            (np.arange(width) - self.cx) / self.fx, (np.arange(height) - self.cy) / self.fy
        )
        if not any(self.distortion):
            return xd, yd
        x: _Array = xd.copy()
        y: _Array = yd.copy()
        with np.errstate(all="ignore"):  # where there is no ray
            for _ in range(_STEPS):
                (x_off, y_off), (xx, xy, yx, yy) = self._distorted(x, y)
                x_off, y_off = x_off - xd, y_off - yd
                determinant = xx * yy - xy * yx
                x = x - (yy * x_off - xy * y_off) / determinant
                y = y - (xx * y_off - yx * x_off) / determinant
                if not (np.hypot(x_off, y_off) > _CLOSE).any():
                    break
            (x_back, y_back), (xx, xy, yx, yy) = self._distorted(x, y)
            found = np.hypot(x_back - xd, y_back - yd) < 1e3 * _CLOSE
            # no ray of the far side of a fold, which is mirrored
            found &= (xx * yy > xy * yx) & (x * xd + y * yd >= 0)
        return np.where(found, x, np.nan), np.where(found, y, np.nan)

    def _distorted(self, x: _Array, y: _Array) -> tuple[tuple[_Array, ...], tuple[_Array, ...]]:
        """Return xd and yd, and their derivatives by x and y in the order xx, xy, yx, yy."""
        k1, k2, p1, p2, k3 = self.distortion
        square = x * x + y * y
        radial = 1 + square * (k1 + square * (k2 + square * k3))
        slope = 2 * (k1 + square * (2 * k2 + square * 3 * k3))
        xd = x * radial + 2 * p1 * x * y + p2 * (square + 2 * x * x)
        yd = y * radial + p1 * (square + 2 * y * y) + 2 * p2 * x * y
        cross = x * y * slope + 2 * p1 * x + 2 * p2 * y
        xx = radial + x * x * slope + 2 * p1 * y + 6 * p2 * x
        yy = radial + y * y * slope + 6 * p1 * y + 2 * p2 * x
        return (xd, yd), (xx, cross, cross, yy)


@dataclass(frozen=True, slots=True)
class Lamp:
    """A small lamp, in the coordinates of the camera: x right, y down, z forward.

    Its intensity falls with the ``beam_exponent``-th power of the cosine to its ``axis``, a unit
    vector; ``dn_per_s`` is how bright, for each second of exposure, a white matt surface is that
    faces it on the axis at 1 m.
    """

    position_m: tuple[float, ...]
    axis: tuple[float, ...]
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


@dataclass(frozen=True, slots=True)
class Extrinsics:
    """Where the sensor is in the frame ``parent``, as of a robot's link.

    A point p of the camera (x right, y down, z where it looks, in m) is at R p + ``translation_m``
    there, with R the unit quaternion ``rotation_xyzw``.
    """

    parent: str
    rotation_xyzw: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)
    translation_m: tuple[float, ...] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Refuse what is no pose (ValueError)."""
        turn, place = self.rotation_xyzw, self.translation_m
        unit = len(turn) == 4 and abs(math.hypot(*turn) - 1) < 1e-3
        if not (self.parent and unit and len(place) == 3 and all(map(math.isfinite, place))):
            raise ValueError(f"{self} has no name, no unit quaternion or no three finite lengths")


@dataclass(frozen=True, slots=True, eq=False)
class FactoryCalibration:
    """What a camera reports about itself.

    Attributes
    ----------
    gains
        complex64 (m + 1, H, W), of the sequence that the camera is fixed to: what its moments are
        divided by, b_0 first, as with a `CalibrationCapture`; None where nominal ones do.
    lens
        None where the camera does not say.
    sensor
        Whose noise the images have; None where the camera does not say.
    extrinsics
        Where it is mounted; None where the camera does not say.
    """

    gains: NDArray[np.complex64] | None = None
    lens: Lens | None = None
    sensor: Sensor | None = None
    extrinsics: Extrinsics | None = None
