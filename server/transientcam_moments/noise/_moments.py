"""From a sensor to the covariance of calibrated moments."""

import math
from collections.abc import Callable, Sequence
from functools import lru_cache, update_wrapper
from typing import Any, Concatenate, Final, NamedTuple, ParamSpec, TypeVar, cast

import numpy as np

from transientcam_moments.arrays import (
    MAX_HARMONICS,
    Array,
    as_array,
    chosen,
    in_range,
    moment_planes,
    namespace,
    squared,
    summary,
)
from transientcam_moments.errors import ParameterError, ShapeError
from transientcam_moments.images import (
    FOUR_PHASES_RAD,
    SIGMA_PX,
    ZEROTH_IMAGES,
    gaussian_taps,
    phase_noise,
    smooth,
)
from transientcam_moments.noise._sensor import ImageNoise, Sensor

_FEW = 1 / 16
"""Share of the pixels up to which their neighbourhoods are quicker to average one by one."""


class MomentNoise(NamedTuple):
    """Noise of moments: independent between planes, and between real and imaginary part.

    Attributes
    ----------
    variance : array, shape (m + 1, ...)
        Of b_0 (0 where it is not measured), and of Re b_j and of Im b_j, each, j = 1 .. m.
    """

    variance: Array

    def __repr__(self) -> str:
        """State the shapes and spans of its arrays."""
        return summary(self)


def moment_noise(
    brightness: Array,
    sensor: Sensor | ImageNoise,
    *,
    calibration: Array,
    zeroth: str,
    takes: int = 1,
    ambient: Array | float = 0.0,
    phases_rad: Sequence[float] = FOUR_PHASES_RAD,
) -> MomentNoise:
    """Return the noise of the calibrated moments of a capture.

    Parameters
    ----------
    brightness : array, shape (...)
        b_0 in DN at the exposure of one image; values below 0 count as 0.
    sensor : Sensor or ImageNoise
        What turns light into numbers.
    calibration : array, shape (m + 1,) or (m + 1, ...)
        The gains that the measured moments are divided by: of the sub-phases
        (`nominal_calibration`), or measured ones.
    zeroth : {"low-frequency", "on-off", "estimated"}
        How b_0 was measured.
    takes : int
        Captures that are averaged.
    ambient : array, shape (...), or float
        Light that is not modulated, in DN an image.
    phases_rad : sequence of float
        Of the images of each frequency.

    Returns
    -------
    MomentNoise

    Raises
    ------
    ParameterError
        For another `zeroth` or takes < 1.
    ShapeError
        When the calibration has not 2 to 33 planes.

    Notes
    -----
    An image at phase theta holds dark + ambient + 1/2 (b_0 + Re(b_j G exp(-i theta))). Two images
    at opposite phases hold b_0 + 2 ambient together, whatever the phase of the signal: real and
    imaginary part of the four-bucket phasor have the same variance and no correlation, and it is
    the same for all frequencies. Divided by G it grows by 1 / |G|^2. The modulus that stands for
    b_0 at the low frequency varies like one component; 2 (on - off) is twice a difference of an
    image with b_0 / 2 and one without. At other phases than the four the same holds of the mean
    of both parts and over all phases of the signal.
    """
    chosen("zeroth", zeroth, tuple(ZEROTH_IMAGES))
    if takes < 1:
        raise ParameterError("takes", takes, ">= 1")
    gain = as_array(calibration)
    if gain.ndim < 1 or not 2 <= gain.shape[0] <= MAX_HARMONICS + 1:
        raise ShapeError("calibration", f"of shape {tuple(gain.shape)}", "2 to 33 planes")
    brightness = as_array(brightness)
    xp = namespace(brightness)
    light = xp.maximum(brightness, 0) + 0.0  # whole numbers become real ones
    size = squared(xp.asarray(gain) + 0j).real
    if gain.ndim == 1:
        size = size.reshape((-1,) + (1,) * light.ndim)
    # signal(theta) + signal(theta + 180 degrees) = b_0 + 2 ambient
    mean = sensor.image_variance((light + 2 * ambient) / 2)
    phasor = (phase_noise(phases_rad) * mean + xp.zeros_like(light)).astype(light.dtype)
    with np.errstate(divide="ignore"):  # of pixels without gain nothing is known
        factor = (1 / (takes * size)).astype(light.dtype)
    variance = phasor * factor
    if zeroth == "low-frequency":
        return MomentNoise(variance)
    zero = xp.zeros_like(light)
    if zeroth == "on-off":
        on, off = sensor.image_variance(light / 2 + ambient), sensor.image_variance(ambient)
        zero = (4 * (on + off) * factor[0]).astype(light.dtype)
    return MomentNoise(xp.concatenate([zero[None], variance[1:]]))


def smoothing_factor(sigma_px: float = SIGMA_PX) -> float:
    """Return what `smooth` leaves of the variance of independent pixels far from the border.

    Parameters
    ----------
    sigma_px : float
        Standard deviation of the Gaussian, 0 to 100.

    Notes
    -----
    The sum of its squared weights.
    """
    in_range("sigma_px", sigma_px, 0.0, 100.0, "0 to 100 pixels")
    if sigma_px == 0:
        return 1.0
    taps = _taps(sigma_px)
    return float((taps**2).sum() / taps.sum() ** 2) ** 2


def own_share(sigma_px: float = SIGMA_PX) -> float:
    """Return what `smooth` leaves of the variance of a pixel at least, whatever is around it.

    Parameters
    ----------
    sigma_px : float
        Standard deviation of the Gaussian, 0 to 100.

    Notes
    -----
    The square of the pixel's own weight, which is larger at the border and beside missing pixels.
    """
    in_range("sigma_px", sigma_px, 0.0, 100.0, "0 to 100 pixels")
    return float(gaussian_taps(sigma_px).max()) ** 4


def smoothed(noise: MomentNoise, sigma_px: float = SIGMA_PX) -> MomentNoise:
    """Return the noise that is left after `smooth`.

    Parameters
    ----------
    noise : MomentNoise
        Of shape (m + 1, H, W), independent between pixels.
    sigma_px : float
        Standard deviation of the Gaussian, 0 to 100.

    Returns
    -------
    MomentNoise
        Of each pixel by itself; neighbours are correlated after smoothing.

    Raises
    ------
    ShapeError
        When there are no image axes.

    Notes
    -----
    The variance is the one before, averaged with the squared weights. Squaring makes a Gaussian of
    sigma / sqrt(2), times the sum of the squares over the square of the sum, of what lies inside.
    """
    in_range("sigma_px", sigma_px, 0.0, 100.0, "0 to 100 pixels")
    variance = noise.variance
    if variance.ndim != 3:
        raise ShapeError("noise", f"of shape {tuple(variance.shape)}", "(m + 1, H, W)")
    if sigma_px == 0:
        return noise
    rows, columns = (_factors(sigma_px, length) for length in variance.shape[-2:])
    left = namespace(variance).asarray(np.outer(rows, columns)).astype(variance.dtype)
    return MomentNoise(smooth(variance, sigma_px / math.sqrt(2)) * left)


def smoothed_of(
    noise_of: Callable[..., MomentNoise],
    brightness: Array,
    sigma_px: float = SIGMA_PX,
    *,
    ambient: Array | None = None,
) -> MomentNoise:
    """Return what `smoothed` gives of an image, by smoothing its brightness alone.

    Parameters
    ----------
    noise_of : callable
        Returns the noise (m + 1, H, W) of each pixel by itself, of its brightness, as
        `moment_noise` does: its variance must be affine in a brightness above 0. Gains of single
        pixels are taken for those of their neighbours. Called with ``ambient=`` where that is
        given, to which the variance must be affine, too.
    brightness : array, shape (H, W)
        In DN.
    sigma_px : float
        Standard deviation of the Gaussian, 0 to 100.
    ambient : array, shape (H, W), optional
        Light that is not modulated, in DN an image.

    Returns
    -------
    MomentNoise
        Of shape (m + 1, H, W).

    Raises
    ------
    ShapeError
        When the brightness is no image.
    """
    in_range("sigma_px", sigma_px, 0.0, 100.0, "0 to 100 pixels")
    if brightness.ndim != 2:
        raise ShapeError("brightness", f"of shape {tuple(brightness.shape)}", "(H, W)")
    if sigma_px == 0:
        return _of_light(noise_of, brightness, ambient)

    def around(light: Array) -> Array:
        """Return the mean of a pixel and its neighbours."""
        return smooth(namespace(light).maximum(light, 0)[None], sigma_px / math.sqrt(2))[0]

    other = None if ambient is None else around(ambient)
    variance = _of_light(noise_of, around(brightness), other).variance
    xp = namespace(variance)
    rows, columns = (_factors(sigma_px, length) for length in brightness.shape)
    left = xp.asarray(rows[:, None].astype(variance.dtype) * columns.astype(variance.dtype))
    return MomentNoise(variance * left)


def smoothed_at(
    noise_of: Callable[..., MomentNoise],
    brightness: Array,
    pixels: Array,
    sigma_px: float = SIGMA_PX,
    *,
    ambient: Array | None = None,
) -> MomentNoise:
    """Return what `smoothed` gives at some pixels, computed for their neighbours alone.

    Parameters
    ----------
    noise_of : callable
        Returns the noise of each pixel by itself, of a brightness of any shape, as `moment_noise`
        with scalar gains: its variance must be affine in a brightness above 0. Called with
        ``ambient=`` as by `smoothed_of`.
    brightness : array, shape (H, W)
        In DN; NaN where there is none.
    pixels : array of int, shape (S,)
        Places in the flattened image.
    sigma_px : float
        Standard deviation of the Gaussian, 0 to 100.
    ambient : array, shape (H, W), optional
        Light that is not modulated, in DN an image.

    Returns
    -------
    MomentNoise
        Of shape (m + 1, S).

    Raises
    ------
    ShapeError
        When the brightness is no image.
    """
    in_range("sigma_px", sigma_px, 0.0, 100.0, "0 to 100 pixels")
    brightness = np.asarray(brightness)
    if brightness.ndim != 2:
        raise ShapeError("brightness", f"of shape {brightness.shape}", "(H, W)")
    if sigma_px == 0:
        there = np.maximum(brightness.reshape(-1)[pixels], 0)
        other = None if ambient is None else np.asarray(ambient).reshape(-1)[pixels]
        return _of_light(noise_of, there, other)
    if pixels.size > _FEW * brightness.size:
        whole = smoothed_of(noise_of, brightness, sigma_px, ambient=ambient).variance
        return MomentNoise(whole.reshape((len(whole), -1))[:, pixels])
    height, width = brightness.shape
    row, column = np.divmod(pixels, width)
    taps = gaussian_taps(sigma_px / math.sqrt(2))
    radius = len(taps) // 2
    shift = np.arange(-radius, radius + 1)
    rows, columns = row[:, None] + shift, column[:, None] + shift
    inside = ((rows >= 0) & (rows < height))[:, :, None]
    inside = inside & ((columns >= 0) & (columns < width))[:, None, :]
    places = rows.clip(0, height - 1)[:, :, None], columns.clip(0, width - 1)[:, None, :]
    weight = np.outer(taps, taps).reshape(-1)
    near = brightness[places]
    present = inside & np.isfinite(near)
    share = present.reshape((-1, weight.size)) @ weight

    def around(near: Array) -> Array:
        """Return the mean of a pixel and its neighbours (S, 2 R + 1, 2 R + 1)."""
        light = np.where(present, np.maximum(near, 0), 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = light.reshape((-1, weight.size)) @ weight / share
        # a pixel that is not finite stays as it is
        return np.where(present[:, radius, radius], mean, np.nan)

    other = None if ambient is None else around(np.asarray(ambient)[places])
    variance = _of_light(noise_of, around(near), other).variance
    left = _factors(sigma_px, height)[row] * _factors(sigma_px, width)[column]
    return MomentNoise((variance * left).astype(variance.dtype))


def _of_light(
    noise_of: Callable[..., MomentNoise], brightness: Array, ambient: Array | None
) -> MomentNoise:
    return noise_of(brightness) if ambient is None else noise_of(brightness, ambient=ambient)


def _taps(sigma_px: float) -> Array:
    radius = int(np.ceil(4 * sigma_px))
    return np.exp(-0.5 * (np.arange(-radius, radius + 1) / sigma_px) ** 2)


@lru_cache(maxsize=64)
def _factors(sigma_px: float, length: int) -> Array:
    """Sum of squares over square of the sum of the weights inside an axis, for each place on it."""
    taps, inside = _taps(sigma_px), np.ones(length)
    sums = (np.convolve(inside, each)[len(taps) // 2 :][:length] for each in (taps**2, taps))
    squares, total = sums
    factors = squares / total**2
    factors.flags.writeable = False  # shared by all calls
    return factors


def draw(b: Array, noise: MomentNoise, random: np.random.Generator, *, draws: int) -> Array:
    """Draw moments with the given mean and noise.

    Parameters
    ----------
    b : array, shape (m + 1, ...)
        Mean moments.
    noise : MomentNoise
        Of shape (m + 1, ...).
    random : numpy.random.Generator
        Where chance comes from.
    draws : int
        How many.

    Returns
    -------
    array, shape (m + 1, draws, ...), complex64 or complex128 as `b`
        Normally distributed: hundreds of electrons make an image.
    """
    b = np.asarray(as_array(b))
    real = np.empty(0, b.dtype).real.dtype
    shape = (b.shape[0], draws, *b.shape[1:])
    deviation = np.sqrt(noise.variance)[:, None]
    noisy = np.empty(shape, b.dtype)
    noisy.real = b.real[:, None] + deviation * random.standard_normal(shape, dtype=real)
    noisy.imag = b.imag[:, None] + deviation * random.standard_normal(shape, dtype=real)
    noisy[0].imag = 0
    return noisy


def scatter(b: Array, noise: MomentNoise, harmonics: Sequence[int], model_error: float) -> Array:
    """Return which share of the deviation of a phase, with a model error, is noise.

    Of the phase of one return, to first order: with w_j = 1 / (v_j + e^2) the inverse of the
    variance of noise and model error together, it is fitted with the information sum_j j^2 w_j, and
    noise alone moves it by the variance sum_j j^2 w_j^2 v_j over the square of that. Where all
    frequencies are as noisy, which they nearly are, it is the same with more returns.

    Parameters
    ----------
    b : array, shape (N, ...)
        Moments.
    noise : MomentNoise
        Of shape (N, ...); moments with a variance that is 0, infinite or NaN count as not measured.
    harmonics : sequence of int
        Which multiples of the base frequency they are; 0 tells no phase.
    model_error : float
        As `tm.likelihood` has it: a standard deviation over the pixel's largest moment.

    Returns
    -------
    array, shape (...)
        0 to 1; NaN where no frequency was measured.
    """
    xp = namespace(b)
    b, variance = as_array(b), as_array(noise.variance)
    seen = (variance > 0) & (variance < np.inf)
    largest = xp.where(seen, xp.maximum(abs(b.real), abs(b.imag)), 0).max(axis=0)
    error = (model_error * largest) ** 2
    information, by_noise = 0 * error, 0 * error
    with np.errstate(all="ignore"):  # pixels without light are computed along
        for at, j in enumerate(harmonics):
            weight = xp.where(seen[at], j * j / (variance[at] + error), 0)
            information = information + weight
            by_noise = by_noise + weight * xp.where(
                seen[at], variance[at] / (variance[at] + error), 0
            )
        share: Array = xp.sqrt(by_noise / information)
    return share.astype(b.real.dtype)


ASSUMED_NOISE: Final = 0.01
"""Standard deviation over the largest moment, where none is given."""
_WITH_UNIT: Final = ("weight", "weight_std", "tail", "tail_std")
_LARGEST_POWER: Final = 126  # of 2, that is a normal number in single precision, as its inverse
_P = ParamSpec("_P")
_T = TypeVar("_T", bound=Any)


def free_of_scale(
    estimate: Callable[Concatenate[Array, MomentNoise, _P], _T],
) -> Callable[Concatenate[Array, MomentNoise | None, _P], _T]:
    """Let an estimate of moments ``b`` assume a ``noise`` of None, at any scale of each pixel.

    The moments are brought to about 1 by a power of 2, so that neither their squares nor those of
    the noise over- or underflow, and what has their unit is brought back.
    """

    def scaled(b: Array, noise: MomentNoise | None, *others: _P.args, **options: _P.kwargs) -> _T:
        if noise is not None:
            return estimate(b, noise, *others, **options)
        planes, trailing = moment_planes(b)
        xp = namespace(planes)
        with np.errstate(invalid="ignore"):  # of pixels that are not finite
            size = xp.maximum(abs(planes.real), abs(planes.imag)).max(axis=0)
            power = xp.where(xp.isfinite(size), xp.frexp(size)[1], 0)
            power = xp.clip(power, -_LARGEST_POWER, _LARGEST_POWER)
            down = xp.ldexp(xp.ones_like(size), -power)
            near = (planes * down).reshape((-1, *trailing))
            variance = (ASSUMED_NOISE * size * down).reshape(trailing) ** 2
            noise = MomentNoise(xp.broadcast_to(variance, near.shape))
            found = estimate(near, noise, *others, **options)
        unit = xp.ldexp(xp.ones_like(size), power).reshape(trailing)
        named = {name: getattr(found, name) * unit for name in _WITH_UNIT if hasattr(found, name)}
        whole: _T = found._replace(**named)
        return whole

    return cast(
        "Callable[Concatenate[Array, MomentNoise | None, _P], _T]", update_wrapper(scaled, estimate)
    )
