"""The registry of products: what clients can ask of a frame, and how each follows from it.

A product names the one input it is computed from: ``raw`` images, the simulated ``truth``, the
``accuracy`` of the range, or a stage of the reconstruction (`imaging/_frames/stages.py`).
The functions here are pure, so any worker may run them.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam import wire
from transientcam_driver import AppliedSequence, RawFrame
from transientcam_moments.plugins import CALLERS, PRODUCTS as OF_PACKAGES, MapProduct, mapped
from transientcam_server.imaging._errors_of_range.noise import moment_noise
from transientcam_server.imaging._products.labelling import image_columns, in_words, moment_columns
from transientcam_server.imaging._products.view import Crop, View
from transientcam_server.imaging._recipe.recipe import Recipe

_Array = NDArray[Any]
BOUNDS_RADIUS: Final = 0.93
"""Of the Poisson kernel that densities between `bounds` are smoothed with: the paper's (Fig. 7)."""
_BOUNDS_BLOCK: Final = 2**20


@dataclass(frozen=True, slots=True)
class Steps:
    """Steps of a 16-bit PNG: how many there are in one unit, and the unit of one step."""

    per_unit: float
    unit: str


def _no_fields(recipe: Recipe, raw: RawFrame, view: View) -> dict[str, Any]:
    return {}


@dataclass(frozen=True, slots=True)
class Product:
    """An array clients can ask for."""

    description: wire.Product
    """Name, unit and axes, as the wire contract has them."""
    needs: str
    """Its input: ``raw``, ``truth``, ``accuracy`` or the name of a stage."""
    compute: Callable[[Recipe, Any, View], _Array]
    """Called as ``compute(recipe, input, view)``, on a worker. A product over time is computed for
    the crop of the view alone, any other one whole."""
    over_time: bool = False
    """Whether it is evaluated at times of flight that the request names."""
    of_view: bool = False
    """Whether it is computed for the pixels of a view alone, as those over time are, too; any other
    one is computed whole, once for all views."""
    of_row: bool = False
    """Whether it is one row of the picture, which the request may name."""
    of_noise: bool = False
    """Whether it is predicted from the noise of the sensor, which must be known."""
    of_toeplitz: bool = False
    """Whether it needs the moments of consecutive multiples of one frequency, 0 to m."""
    of_brightness: bool = False
    """Whether it needs b_0, which is measured, or else estimated from such moments."""
    reads: tuple[str, ...] = ()
    """Attributes of its input that a product over time is computed from; it may be computed for
    long, and the rest of the frame need not stay for that."""
    stated: MapProduct | None = None
    """What it says of itself where another package computes it."""
    steps: Steps | None = None
    """Of a 16-bit PNG; None for steps of one unit."""
    fields: Callable[[Recipe, RawFrame, View], dict[str, Any]] = _no_fields
    """Called as ``fields(recipe, raw, view)``: what the messages of this product alone hold."""
    archive: Callable[[Recipe, RawFrame, View], dict[str, Any]] = _no_fields
    """Called in the same way, on a worker: what an archive of this product holds beside that,
    arrays of any size."""

    @property
    def name(self) -> str:
        """The name clients ask by."""
        return self.description.name

    @property
    def long(self) -> bool:
        """Whether it may take so long that new frames must be computed beside it."""
        return self.over_time or self.stated is not None

    @property
    def cropped(self) -> bool:
        """Whether what is computed are the pixels of the view."""
        return self.over_time or self.of_view

    @property
    def png_steps(self) -> Steps | None:
        """Steps of a 16-bit PNG; None where the product is no image."""
        if len(self.description.axes) != 2:
            return None
        return self.steps or Steps(1.0, self.description.unit)

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

    def with_fields(self, recipe: Recipe, raw: RawFrame, view: View) -> dict[str, Any]:
        """Return what messages of this product hold beside the array and the frame's metadata."""
        times = {"time_s": list(view.time_s)} if self.over_time else {}
        return times | self.fields(recipe, raw, view)


def _coefficient_planes(recipe: Recipe, found: tm.Reconstruction, view: View) -> _Array:
    coefficients = _cropped(found.coefficients, view.crop)
    m = coefficients.polynomial.shape[0] - 1
    planes = np.empty((2 * m + 1, *coefficients.error.shape), dtype=np.float32)
    planes[0] = coefficients.error
    planes[1::2] = coefficients.polynomial[1:].real
    planes[2::2] = coefficients.polynomial[1:].imag
    return planes


def _transient(recipe: Recipe, found: tm.Reconstruction, view: View) -> _Array:
    rad_s = 2.0 * np.pi * recipe.base_frequency_hz
    # h is per radian: g(tau) = 2 pi f h(2 pi f tau)
    density: _Array = tm.density(
        _cropped(found.coefficients, view.crop), rad_s * np.array(view.time_s)
    )
    return np.float32(rad_s) * density


def _density_std(recipe: Recipe, found: tm.Reconstruction, view: View) -> _Array:
    rad_s = 2.0 * np.pi * recipe.base_frequency_hz
    noise = moment_noise(recipe, found)
    std: _Array = tm.noise.density_std(
        view.crop.apply(found.smoothed),
        tm.noise.MomentNoise(view.crop.apply(noise.variance)),
        rad_s * np.array(view.time_s),
        epsilon=recipe.settings.bias,
        zeroth=recipe.applied.sequence.zeroth,
    )
    return np.float32(rad_s) * std


def _cumulative(recipe: Recipe, found: tm.Reconstruction, view: View) -> _Array:
    phase_rad = 2.0 * np.pi * recipe.base_frequency_hz * np.array(view.time_s)
    cumulative: _Array = tm.cumulative(_cropped(found.coefficients, view.crop), phase_rad)
    return cumulative


def _cropped(coefficients: tm.Coefficients, crop: Crop) -> tm.Coefficients:
    return tm.Coefficients(*map(crop.apply, coefficients))


def _streak(recipe: Recipe, found: tm.Reconstruction, view: View) -> _Array:
    """Return the density (T, W) of one row, of the columns that the crop leaves."""
    height, width = found.coefficients.error.shape
    y = height // 2 if view.y is None else view.y
    x, _, columns, _ = view.crop.region or (0, 0, width, height)
    line = Crop((x, y, columns, 1), view.crop.decimation)
    return _transient(recipe, found, View(view.time_s, line))[:, 0]


def _bounds(recipe: Recipe, found: tm.Reconstruction, view: View) -> _Array:
    """Return what every smoothed density with these moments lies between (2, T, H, W)."""
    rad_s = 2.0 * np.pi * recipe.base_frequency_hz
    phase_rad = rad_s * np.array(view.time_s)
    moments = view.crop.apply(found.moments)
    planes = moments.reshape(len(moments), -1)
    between = np.empty((2, len(phase_rad), planes.shape[1]), dtype=np.float32)
    # pixel by pixel they need several arrays as large as the answer
    step = max(1, _BOUNDS_BLOCK // max(1, len(phase_rad)))
    for first in range(0, planes.shape[1], step):
        block = slice(first, first + step)
        between[:, :, block] = tm.bounds(planes[:, block], phase_rad, radius=BOUNDS_RADIUS)
    between *= np.float32(rad_s)
    return between.reshape(2, len(phase_rad), *moments.shape[1:])


def _pointcloud(recipe: Recipe, found: tm.Reconstruction, view: View) -> _Array:
    range_m = found.range_m
    return recipe.lens(*range_m.shape).points(range_m)


def _return_planes(recipe: Recipe, found: tm.Reconstruction, view: View) -> _Array:
    """Return time of flight and weight (2 m, H, W) of each return, the strongest first."""
    phase_rad, weight = map(view.crop.apply, (found.returns.phase_rad, found.returns.weight))
    order = np.argsort(-weight, axis=0, kind="stable")
    planes = np.empty((2 * len(weight), *weight.shape[1:]), dtype=np.float32)
    rad_s = 2.0 * np.pi * recipe.base_frequency_hz
    planes[0::2] = np.take_along_axis(phase_rad, order, axis=0) / rad_s
    planes[1::2] = np.take_along_axis(weight, order, axis=0)
    return planes


def _frames_averaged(recipe: Recipe, found: tm.Reconstruction, view: View) -> _Array:
    one = np.ones(found.flags.shape)
    return one if found.frames_averaged is None else np.asarray(found.frames_averaged)


def _property(name: str) -> Callable[[Recipe, object, View], _Array]:
    """Return a computation that reads a property of the input."""

    def read(recipe: Recipe, found: object, view: View) -> _Array:
        array: _Array = getattr(found, name)
        return array

    return read


def _labels(recipe: Recipe, raw: RawFrame, view: View) -> dict[str, Any]:
    return {"labels": [asdict(label) | {"kind": label.kind} for label in raw.labels]}


def _frequencies(recipe: Recipe, raw: RawFrame, view: View) -> dict[str, Any]:
    """Return which multiple of the base frequency each plane is of, and that frequency."""
    multiples = (0, *recipe.applied.sequence.multiples)
    f_hz = recipe.base_frequency_hz
    return {"multiples": list(multiples), "frequencies_hz": [j * f_hz for j in multiples]}


def _evaluation(recipe: Recipe, raw: RawFrame, view: View) -> dict[str, Any]:
    """Return what the images show and how they become moments, and the settings of the service."""
    columns = image_columns(raw.labels)
    columns |= moment_columns(recipe.applied, raw.labels, recipe.gains)
    arrays = {
        name: view.crop.apply(in_words(column), column.axes) for name, column in columns.items()
    }
    return arrays | {"reconstruction": recipe.settings.model_dump()}


def _intrinsics(recipe: Recipe, raw: RawFrame, view: View) -> dict[str, Any]:
    height, width = raw.images.shape[-2:]
    return {"intrinsics": asdict(recipe.lens(height, width))}


_MILLIMETRES: Final = Steps(1e3, "mm")


def _product(
    name: str, needs: str, compute: Callable[..., _Array] | str, **more: Any
) -> tuple[str, Product]:
    """Return one of ours by its name, computed as it says or a property of its input."""
    called = _property(compute) if isinstance(compute, str) else compute
    return name, Product(wire.PRODUCTS[name], needs, called, **more)


_of_noise: Final = partial(_product, of_noise=True)
_of_accuracy: Final = partial(_of_noise, needs="accuracy", steps=_MILLIMETRES)
_over_time: Final = partial(_product, over_time=True, of_toeplitz=True)
_of_polynomial: Final = partial(_over_time, needs="coefficients", reads=("coefficients",))
_TEN_THOUSANDTHS: Final = Steps(1e4, "1e-4")

PRODUCTS: Final = dict((
    _product("range", "returns", "range_m", steps=_MILLIMETRES),
    _product("direct", "returns", "direct"),
    _product("indirect", "returns", "indirect"),
    _product("uniform", "returns", "uniform", of_brightness=True),
    _product("brightness", "light", "brightness", of_brightness=True),
    _product("validity", "light", "validity", of_toeplitz=True, steps=_TEN_THOUSANDTHS),
    _of_accuracy("range_std", compute="std_m"),
    _of_accuracy("range_bias", compute="bias_m", of_toeplitz=True),
    _of_accuracy("range_error", compute="error_m", of_toeplitz=True),
    _of_noise("trust", "accuracy", "trust", of_toeplitz=True),
    _of_noise(
        "reduced_chi_square", "misfit", "reduced_chi_square", steps=Steps(1e2, "1e-2")
    ),
    _product("frames_averaged", "light", _frames_averaged),
    _product("flags", "light", "flags"),
    _product("coefficients", "coefficients", _coefficient_planes, of_view=True, of_toeplitz=True),
    _product("moments", "moments", "moments", fields=_frequencies),
    _product("measured_moments", "moments", "measured", fields=_frequencies),
    _product("raw", "raw", "images", fields=_labels, archive=_evaluation),
    _of_polynomial("transient", compute=_transient),
    _over_time(
        "density_std", "moments", _density_std, of_noise=True,
        reads=("smoothed", "ambient", "settings", "variance_share"),
    ),
    _of_polynomial("cumulative", compute=_cumulative),
    _of_polynomial(
        "streak", compute=_streak, of_row=True, steps=Steps(1e-7, "1e7 DN/s"),
        fields=lambda recipe, raw, view: {"y": view.y},
    ),
    _over_time(
        "bounds", "moments", _bounds, reads=("moments",),
        fields=lambda recipe, raw, view: {"radius": BOUNDS_RADIUS},
    ),
    _product("returns", "returns", _return_planes, of_view=True),
    _product("pointcloud", "returns", _pointcloud, fields=_intrinsics),
    _product("truth", "truth", "range_m", steps=_MILLIMETRES),
    _product("direct_share", "truth", "direct_share", steps=_TEN_THOUSANDTHS),
))  # fmt: skip
"""Ours by name: an entry here and one in `transientcam.wire.PRODUCTS` make a product."""
OF_PACKAGES.taken.update(PRODUCTS, *(each.axes for each in wire.PRODUCTS.values()))
OF_PACKAGES.taken.update(("frame", "pixel", "device_time_s", "host_time_s"))  # beside products


def product_names() -> tuple[str, ...]:
    """Return the names of our products, and of those that other packages offer."""
    return (*PRODUCTS, *OF_PACKAGES.names())


def product_of(name: str) -> Product:
    """Return a product, ours or another package's.

    Raises KeyError where there is none of that name, PluginFailed where it cannot be used.
    """
    if name in PRODUCTS or name not in product_names():
        return PRODUCTS[name]
    stated = OF_PACKAGES.load(name)
    return Product(
        wire.Product(name, stated.unit, ("y", "x"), "<f4", stated.summary),
        "light",
        partial(_mapped, name),
        of_toeplitz=stated.consecutive,
        stated=stated,
        steps={"m": _MILLIMETRES, "1": _TEN_THOUSANDTHS}.get(stated.unit),
    )


def _mapped(name: str, recipe: Recipe, found: tm.Reconstruction, view: View) -> _Array:
    """Return the map of another package, of the moments as they were measured."""
    b, noise = np.asarray(found.smoothed), found.noise
    variance = None if noise is None else np.broadcast_to(noise.variance, b.shape)
    multiples = np.array((0, *recipe.applied.sequence.multiples))
    told = variance, recipe.base_frequency_hz * multiples
    array: _Array = CALLERS[-1](OF_PACKAGES.group, mapped, name, b, *told)
    return array
