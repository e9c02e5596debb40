"""What can be computed from a frame, and from what: the registry of stages and products.

A *stage* is an intermediate result, a *product* an array that clients can ask for. Both name the
stages they need; `transientcam_server.pipeline` computes each at most once a frame, and only if
somebody asked. The functions here are pure, so any executor may run them.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import transientcam_moments as tm
from numpy.typing import NDArray
from transientcam import wire
from transientcam_driver import AppliedSequence, RawFrame

from transientcam_server.settings import ReconstructionSettings

_Array = NDArray[Any]


@dataclass(frozen=True, slots=True)
class Recipe:
    """What a computation may know beside the results it needs.

    ``full_scale`` is the largest value that the sensor gives, in DN.
    """

    applied: AppliedSequence
    settings: ReconstructionSettings
    full_scale: float

    @property
    def base_frequency_hz(self) -> float:
        """The frequency whose period is the unambiguous time of flight."""
        return self.applied.sequence.base_frequency_hz


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """Moments fit for reconstruction, and what was found out on the way there.

    Attributes
    ----------
    b
        complex64 (m+1, H, W), calibrated, smoothed, biased, in DN.
    validity
        float32 (H, W), smallest eigenvalue over b_0 before biasing.
    flags
        uint8 (H, W), `transientcam_moments.Flags`.
    """

    b: _Array
    validity: _Array
    flags: _Array


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
        As for a stage; a product over time takes ``time_s`` after the recipe.
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

    def shape(self, applied: AppliedSequence, height: int, width: int) -> tuple[int, ...]:
        """Shape of the array for a sequence; empty for a product over time, which has none yet."""
        m = applied.sequence.harmonics
        lengths = {"y": height, "x": width, "moment": m + 1, "coefficient": 2 * m + 1}
        lengths["image"] = applied.images
        if self.over_time:
            return ()
        return tuple(lengths[axis] for axis in self.description.axes)


# -- stages ------------------------------------------------------------------------------------


def reconstructible(
    calibrated: _Array, *, zeroth: str, settings: ReconstructionSettings
) -> Moments:
    """Return calibrated moments (m+1, H, W) made fit for reconstruction (Sec. 4.3)."""
    smooth = tm.smooth(calibrated, sigma_px=settings.smoothing_px)
    if zeroth == "estimated":
        smooth = tm.estimate_zeroth(smooth, epsilon=settings.bias)
    eigenvalue = tm.smallest_eigenvalue(smooth)
    with np.errstate(all="ignore"):  # b_0 = 0 is flagged, not an error
        validity = eigenvalue / smooth[0].real
    flags = tm.flags(smooth, eigenvalue=eigenvalue)
    biased = tm.bias(smooth, epsilon=settings.bias)
    # what was indefinite is not any more, and says so
    flags = np.where(biased.biased, flags & ~np.uint8(tm.Flags.DEGENERATE), flags)
    flags |= np.where(biased.biased, np.uint8(tm.Flags.BIASED), np.uint8(0))
    return Moments(biased.moments, np.asarray(validity, dtype=np.float32), flags)


def _moments(recipe: Recipe, raw: RawFrame) -> Moments:
    sequence = recipe.applied.sequence
    measured = tm.measure(raw.images, takes=sequence.takes, zeroth=sequence.zeroth)
    calibration = tm.nominal_calibration(
        sequence.harmonics,
        sequence.sub_phases.phases_rad,
        sequence.sub_phases.weights,
        sequence.zeroth,
    )
    calibrated = tm.calibrate(measured, calibration)
    moments = reconstructible(calibrated, zeroth=sequence.zeroth, settings=recipe.settings)
    saturated = tm.saturated(raw.images, full_scale=recipe.full_scale)
    flags = moments.flags | np.where(saturated, np.uint8(tm.Flags.SATURATED), np.uint8(0))
    return replace(moments, flags=flags)


def _coefficients(recipe: Recipe, moments: Moments) -> tm.Coefficients:
    return tm.levinson(moments.b)


def _returns(recipe: Recipe, moments: Moments) -> tm.Returns:
    return tm.pisarenko(moments.b)


def _separation(recipe: Recipe, returns: tm.Returns) -> tm.Separation:
    return tm.separate(returns, threshold=recipe.settings.return_threshold)


STAGES: Final[dict[str, Stage]] = {
    "moments": Stage(("raw",), _moments),
    "coefficients": Stage(("moments",), _coefficients),
    "returns": Stage(("moments",), _returns),
    "separation": Stage(("returns",), _separation),
}
"""Intermediate results by name; ``raw`` and ``truth`` are there without computing."""


def pixel_counts(moments: Moments) -> dict[str, int]:
    """Return how many pixels carry each flag."""
    flags = moments.flags
    counts = {"total": int(flags.size), "valid": int(np.count_nonzero(flags == 0))}
    for flag in tm.Flags:
        counts[str(flag.name).lower()] = int(np.count_nonzero(flags & flag.value))
    return counts


# -- products ----------------------------------------------------------------------------------


def _range(recipe: Recipe, separation: tm.Separation, moments: Moments) -> _Array:
    range_m = tm.range_m(separation.phase_rad, recipe.base_frequency_hz)
    return np.where(moments.flags & _WITHOUT_RANGE, np.float32(np.nan), range_m)


def _coefficient_planes(recipe: Recipe, coefficients: tm.Coefficients) -> _Array:
    m = coefficients.polynomial.shape[0] - 1
    planes = np.empty((2 * m + 1, *coefficients.error.shape), dtype=np.float32)
    planes[0] = coefficients.error
    planes[1::2] = coefficients.polynomial[1:].real
    planes[2::2] = coefficients.polynomial[1:].imag
    return planes


def _transient(recipe: Recipe, time_s: _Array, coefficients: tm.Coefficients) -> _Array:
    rad_s = 2.0 * np.pi * recipe.base_frequency_hz
    # h is per radian: g(tau) = 2 pi f h(2 pi f tau)
    density: _Array = tm.density(coefficients, rad_s * time_s)
    return np.float32(rad_s) * density


def _cumulative(recipe: Recipe, time_s: _Array, coefficients: tm.Coefficients) -> _Array:
    phase_rad = 2.0 * np.pi * recipe.base_frequency_hz * time_s
    cumulative: _Array = tm.cumulative(coefficients, phase_rad)
    return cumulative


def _product(
    name: str, needs: tuple[str, ...], compute: Callable[..., _Array], *, over_time: bool = False
) -> Product:
    description = wire.PRODUCTS[name]
    png_scale, png_unit = None, ""
    if description.axes == ("y", "x"):
        png_scale, png_unit = _PNG_STEPS.get(name, (1.0, description.unit))
    return Product(description, needs, compute, over_time, png_scale, png_unit)


_WITHOUT_RANGE = np.uint8(tm.INVALID)
_PNG_STEPS = {"range": (1e3, "mm"), "truth": (1e3, "mm"), "validity": (1e4, "1e-4")}

PRODUCTS: Final[dict[str, Product]] = {
    product.name: product
    for product in (
        _product("range", ("separation", "moments"), _range),
        _product("direct", ("separation",), lambda _, separation: separation.direct),
        _product("indirect", ("separation",), lambda _, separation: separation.indirect),
        _product("uniform", ("returns",), lambda _, returns: returns.uniform),
        _product("brightness", ("moments",), lambda _, moments: moments.b[0].real),
        _product("validity", ("moments",), lambda _, moments: moments.validity),
        _product("flags", ("moments",), lambda _, moments: moments.flags),
        _product("coefficients", ("coefficients",), _coefficient_planes),
        _product("moments", ("moments",), lambda _, moments: moments.b),
        _product("raw", ("raw",), lambda _, raw: raw.images),
        _product("transient", ("coefficients",), _transient, over_time=True),
        _product("cumulative", ("coefficients",), _cumulative, over_time=True),
        _product("truth", ("truth",), lambda _, truth: truth.range_m),
    )
}
"""Every product by name."""
