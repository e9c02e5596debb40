"""What can be computed from a frame, and from what: the registry of stages and products.

A *stage* is an intermediate result, a *product* an array that clients can ask for. Both name the
stages they need; `transientcam_server.imaging.frame` computes each at most once a frame, and
only on request. The functions here are pure, so any executor may run them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam import wire
from transientcam_driver import AppliedSequence, RawFrame
from transientcam_server.imaging.calibration import nominal_gains
from transientcam_server.imaging.recipe import Recipe
from transientcam_server.imaging.view import Crop, View

_Array = NDArray[Any]
BOUNDS_RADIUS: Final = 0.93
"""Of the Poisson kernel that densities between `bounds` are smoothed with: the paper's (Fig. 7)."""
_BOUNDS_BLOCK: Final = 2**20


@dataclass(frozen=True, slots=True)
class Stage:
    """An intermediate result: ``compute(recipe, *results of needs)``."""

    needs: tuple[str, ...]
    compute: Callable[..., Any]


@dataclass(frozen=True, slots=True)
class Product:
    """An array clients can ask for.

    Attributes
    ----------
    description
        Name, unit and axes, as the wire contract has them.
    needs, compute
        As for a stage; a product over time takes a `View` after the recipe, and is computed for
        its crop alone.
    over_time
        Whether it is evaluated at times of flight that the request names.
    png_scale, png_unit
        Steps of a 16-bit PNG in one unit, and what one step is then; None where the product is
        no image.
    """

    description: wire.Product
    needs: tuple[str, ...]
    compute: Callable[..., _Array]
    over_time: bool = False
    png_scale: float | None = None
    png_unit: str = ""

    @property
    def name(self) -> str:
        """The name clients ask by."""
        return self.description.name

    def shape(
        self, applied: AppliedSequence, height: int, width: int, *, times: int = 0
    ) -> tuple[int, ...]:
        """Shape of the array for a sequence; empty for a product over time without times."""
        m = applied.sequence.harmonics
        lengths = {"y": height, "x": width, "moment": m + 1, "coefficient": 2 * m + 1}
        lengths |= {"image": applied.images, "coordinate": 3, "return": 2 * m}
        lengths |= {"bound": 2, "time": times}
        if self.over_time and not times:
            return ()
        return tuple(lengths[axis] for axis in self.description.axes)


# -- stages ------------------------------------------------------------------------------------


def _reconstruction(recipe: Recipe, raw: RawFrame) -> tm.Reconstruction:
    sequence = recipe.applied.sequence
    calibration = recipe.calibration
    settings = recipe.settings.for_moments(
        base_frequency_hz=sequence.base_frequency_hz,
        zeroth=sequence.zeroth,
        takes=sequence.takes,
        full_scale=recipe.full_scale,
    )
    reconstruction = tm.reconstruct(
        raw.by_take.reshape(raw.images.shape),
        settings,
        calibration=nominal_gains(sequence) if calibration is None else calibration.gains,
        bad_pixels=None if calibration is None else calibration.bad,
    )
    return _computed(reconstruction, "moments", "flags", "validity")


def _computed(reconstruction: tm.Reconstruction, *names: str) -> tm.Reconstruction:
    """Compute properties now, so that no product has to that needs no more than reading them."""
    for name in names:
        getattr(reconstruction, name)
    return reconstruction


def _coefficients(recipe: Recipe, reconstruction: tm.Reconstruction) -> tm.Coefficients:
    return reconstruction.coefficients


def _returns(recipe: Recipe, reconstruction: tm.Reconstruction) -> tm.Reconstruction:
    return _computed(reconstruction, "returns", "direct", "range_m")


STAGES: Final[dict[str, Stage]] = {
    "moments": Stage(("raw",), _reconstruction),
    "coefficients": Stage(("moments",), _coefficients),
    "returns": Stage(("moments",), _returns),
}
"""Intermediate results by name; ``raw`` and ``truth`` are there without computing."""


def pixel_counts(reconstruction: tm.Reconstruction) -> dict[str, int]:
    """Return how many pixels carry each flag."""
    flags = reconstruction.flags
    counts = {"total": int(flags.size), "valid": int(np.count_nonzero(flags == 0))}
    for flag in tm.Flags:
        if flag:
            counts[str(flag.name).lower()] = int(np.count_nonzero(flags & flag.value))
    return counts


# -- products ----------------------------------------------------------------------------------


def _coefficient_planes(recipe: Recipe, coefficients: tm.Coefficients) -> _Array:
    m = coefficients.polynomial.shape[0] - 1
    planes = np.empty((2 * m + 1, *coefficients.error.shape), dtype=np.float32)
    planes[0] = coefficients.error
    planes[1::2] = coefficients.polynomial[1:].real
    planes[2::2] = coefficients.polynomial[1:].imag
    return planes


def _transient(recipe: Recipe, view: View, coefficients: tm.Coefficients) -> _Array:
    rad_s = 2.0 * np.pi * recipe.base_frequency_hz
    # h is per radian: g(tau) = 2 pi f h(2 pi f tau)
    density: _Array = tm.density(_cropped(coefficients, view.crop), rad_s * np.array(view.time_s))
    return np.float32(rad_s) * density


def _cumulative(recipe: Recipe, view: View, coefficients: tm.Coefficients) -> _Array:
    phase_rad = 2.0 * np.pi * recipe.base_frequency_hz * np.array(view.time_s)
    cumulative: _Array = tm.cumulative(_cropped(coefficients, view.crop), phase_rad)
    return cumulative


def _cropped(coefficients: tm.Coefficients, crop: Crop) -> tm.Coefficients:
    return tm.Coefficients(*map(crop.apply, coefficients))


def _streak(recipe: Recipe, view: View, coefficients: tm.Coefficients) -> _Array:
    """Return the density (T, W) of one row, of the columns that the crop leaves."""
    height, width = coefficients.error.shape
    y = height // 2 if view.y is None else view.y
    x, _, columns, _ = view.crop.region or (0, 0, width, height)
    line = Crop((x, y, columns, 1), view.crop.decimation)
    return _transient(recipe, View(view.time_s, line), coefficients)[:, 0]


def _bounds(recipe: Recipe, view: View, reconstruction: tm.Reconstruction) -> _Array:
    """Return what every smoothed density with these moments lies between (2, T, H, W)."""
    rad_s = 2.0 * np.pi * recipe.base_frequency_hz
    phase_rad = rad_s * np.array(view.time_s)
    moments = view.crop.apply(reconstruction.moments)
    planes = moments.reshape(len(moments), -1)
    between = np.empty((2, len(phase_rad), planes.shape[1]), dtype=np.float32)
    # pixel by pixel they need several arrays as large as the answer
    step = max(1, _BOUNDS_BLOCK // max(1, len(phase_rad)))
    for first in range(0, planes.shape[1], step):
        block = slice(first, first + step)
        between[:, :, block] = tm.bounds(planes[:, block], phase_rad, radius=BOUNDS_RADIUS)
    between *= np.float32(rad_s)
    return between.reshape(2, len(phase_rad), *moments.shape[1:])


def _pointcloud(recipe: Recipe, found: tm.Reconstruction) -> _Array:
    range_m = found.range_m
    return recipe.lens(*range_m.shape).points(range_m)


def _return_planes(recipe: Recipe, found: tm.Reconstruction) -> _Array:
    """Return time of flight and weight (2 m, H, W) of each return, the strongest first."""
    phase_rad, weight = found.returns.phase_rad, found.returns.weight
    order = np.argsort(-weight, axis=0, kind="stable")
    planes = np.empty((2 * len(weight), *weight.shape[1:]), dtype=np.float32)
    rad_s = 2.0 * np.pi * recipe.base_frequency_hz
    planes[0::2] = np.take_along_axis(phase_rad, order, axis=0) / rad_s
    planes[1::2] = np.take_along_axis(weight, order, axis=0)
    return planes


def _product(
    name: str, needs: tuple[str, ...], compute: Callable[..., _Array], *, over_time: bool = False
) -> Product:
    description = wire.PRODUCTS[name]
    png_scale, png_unit = None, ""
    if len(description.axes) == 2:
        png_scale, png_unit = _PNG_STEPS.get(name, (1.0, description.unit))
    return Product(description, needs, compute, over_time, png_scale, png_unit)


_PNG_STEPS = {
    "range": (1e3, "mm"),
    "truth": (1e3, "mm"),
    "validity": (1e4, "1e-4"),
    "streak": (1e-7, "1e7 DN/s"),
}

PRODUCTS: Final[dict[str, Product]] = {
    product.name: product
    for product in (
        _product("range", ("returns",), lambda _, found: found.range_m),
        _product("direct", ("returns",), lambda _, found: found.direct),
        _product("indirect", ("returns",), lambda _, found: found.indirect),
        _product("uniform", ("returns",), lambda _, found: found.uniform),
        _product("brightness", ("moments",), lambda _, found: found.brightness),
        _product("validity", ("moments",), lambda _, found: found.validity),
        _product("flags", ("moments",), lambda _, found: found.flags),
        _product("coefficients", ("coefficients",), _coefficient_planes),
        _product("moments", ("moments",), lambda _, found: found.moments),
        _product("raw", ("raw",), lambda _, raw: raw.images),
        _product("transient", ("coefficients",), _transient, over_time=True),
        _product("cumulative", ("coefficients",), _cumulative, over_time=True),
        _product("streak", ("coefficients",), _streak, over_time=True),
        _product("bounds", ("moments",), _bounds, over_time=True),
        _product("returns", ("returns",), _return_planes),
        _product("pointcloud", ("returns",), _pointcloud),
        _product("truth", ("truth",), lambda _, truth: truth.range_m),
    )
}
"""Every product by name."""
