"""From raw images to moments: phase steps and the zeroth moment (Sec. 3.1 and 4.3)."""

from collections.abc import Sequence

import numpy as np

from transientcam_moments._dispatch import accelerated
from transientcam_moments.arrays import (
    MAX_HARMONICS,
    Array,
    as_array,
    chosen,
    namespace,
    squared,
    to_complex,
)
from transientcam_moments.errors import ParameterError, ShapeError
from transientcam_moments.images._phase_steps import FOUR_PHASES_RAD, is_four_bucket, phase_weights
from transientcam_moments.images._takes import average_takes

ZEROTH_IMAGES = {"low-frequency": 4, "on-off": 2, "estimated": 0}
"""Images that each way to measure b_0 costs, at four phases."""


def four_bucket(images: Array) -> Array:
    """Combine images at four phase steps into complex phasors.

    Parameters
    ----------
    images : array, shape (F, 4, ...)
        F frequencies, phase steps 0, 90, 180 and 270 degrees, any integer or real type.

    Returns
    -------
    array, shape (F, ...), complex64 (complex128 for float64 images)
        (I_0 - I_180) + i (I_90 - I_270), in the unit of the images.

    Raises
    ------
    ShapeError
        When the second axis doesn't have the four phase steps.

    Notes
    -----
    Sec. 3.1. The difference of opposite phases removes ambient light, dark level and even
    harmonics of the modulation.
    """
    images = as_array(images)
    if images.ndim < 2 or images.shape[1] != 4:
        raise ShapeError("images", f"of shape {tuple(images.shape)}", "(F, 4, ...)")
    values = _real(images)
    return to_complex(values[:, 0] - values[:, 2], values[:, 1] - values[:, 3])


def demodulate(images: Array, phase_rad: Array | Sequence[float]) -> Array:
    """Combine images at any phases into complex phasors, by least squares.

    Parameters
    ----------
    images : array, shape (F, N, ...)
        F frequencies, N >= 3 phases, any integer or real type.
    phase_rad : array, shape (N,)
        The phases, the same at every frequency.

    Returns
    -------
    array, shape (F, ...), complex64 (complex128 for float64 images)
        sum_k weight_k I_k with the weights of `phase_weights`, in the unit of the images: to the
        bit what `four_bucket` returns, where the phases are 0, 90, 180 and 270 degrees.

    Raises
    ------
    ShapeError
        When there is not one image for each phase.
    ParameterError
        For less than three different phases.
    """
    if is_four_bucket(phase_rad):
        return four_bucket(images)
    weight = phase_weights(phase_rad)
    images = as_array(images)
    if images.ndim < 2 or images.shape[1] != len(weight):
        raise ShapeError("images", f"of shape {tuple(images.shape)}", f"(F, {len(weight)}, ...)")
    values = _real(images)
    return to_complex(_weighted(values, weight.real), _weighted(values, weight.imag))


def _weighted(values: Array, weight: Array) -> Array:
    """Return sum_k weight_k values_k (F, ...): several times as fast as a product of matrices."""
    total = float(weight[0]) * values[:, 0]
    for k in range(1, len(weight)):
        total = total + float(weight[k]) * values[:, k]
    return total


def measure(
    images: Array | Sequence[Array],
    *,
    zeroth: str,
    takes: int = 1,
    phases_rad: Sequence[float] = FOUR_PHASES_RAD,
) -> Array:
    """Turn the images of one capture into uncalibrated moments.

    Parameters
    ----------
    images : array, shape (N, ...) or (takes, F, 4, H, W), or a list of N images
        In capture order: for each take, for each frequency (that of b_0 first, then j = 1 .. m),
        phase steps 0, 90, 180, 270 degrees; "on-off" has an image with and one without
        illumination in place of the first four.
    zeroth : {"low-frequency", "on-off", "estimated"}
        How b_0 was measured.
    takes : int
        Captures to be averaged, outliers left out (see `average_takes`). Five axes carry their own.
    phases_rad : sequence of float
        Of the images of each frequency, where they are others than those four; see `demodulate`.

    Returns
    -------
    array, shape (m + 1, ...), complex64 (complex128 for float64 images)
        Uncalibrated moments. b_0 is real: the modulus of the phasor at the low frequency, twice
        the difference of on and off, or 0 when it is to be estimated.

    Raises
    ------
    ShapeError
        When the number of images is none that such a capture has.
    ParameterError
        For another `zeroth` or for takes < 1.

    Notes
    -----
    Sec. 4.3. At 0.9 MHz the way of the light is a small fraction of the wavelength (333 m), so
    that every return has nearly the same phase and the phasors add up in length: the modulus is
    b_0 times a factor that falls short of 1 by half the variance of that phase (at most 0.8 % over
    the unambiguous range at 23 MHz), whatever the common phase of range and electronics is.
    The real part would lose with the cosine of it.
    An image without illumination is the dark level alone, one with it is higher by b_0 / 2.
    """
    chosen("zeroth", zeroth, tuple(ZEROTH_IMAGES))
    stack = takes_first(images, takes, len(phases_rad))
    harmonics_of(stack.shape[1], zeroth, len(phases_rad))
    average = average_takes(stack).images
    if is_four_bucket(phases_rad):
        return _measure(average, zeroth)
    return _combined(average, zeroth, phases_rad)


def harmonics_of(images: int, zeroth: str, phases: int = 4) -> int:
    """Return how many frequencies a take of so many images has, beside that of b_0.

    Raises
    ------
    ShapeError
        When the number of images is none that such a capture has.
    """
    of_zeroth = _zeroth_images(zeroth, phases)
    m, rest = divmod(images - of_zeroth, phases)
    if rest or not 1 <= m <= MAX_HARMONICS:
        expected = f"{of_zeroth} + {phases} m of them a take, m in 1..32, for {zeroth!r}"
        raise ShapeError("images", f"{images} images a take", expected)
    return m


@accelerated("measure", order=lambda images, zeroth: harmonics_of(len(images), zeroth), of="H")
def _measure(images: Array, zeroth: str) -> Array:
    """Planar statement of `measure` for the images (N, ...) of one take."""
    return _combined(images, zeroth, FOUR_PHASES_RAD)


def _combined(images: Array, zeroth: str, phases_rad: Sequence[float]) -> Array:
    average = _real(images)
    xp = namespace(average)
    phases = len(phases_rad)
    m = harmonics_of(len(images), zeroth, phases)
    modulated = average[_zeroth_images(zeroth, phases) :]
    phasors = demodulate(modulated.reshape((m, phases, *average.shape[1:])), phases_rad)
    if zeroth == "low-frequency":
        low = demodulate(average[None, :phases], phases_rad)[0]
        b0 = xp.sqrt(squared(low))
    elif zeroth == "on-off":
        b0 = 2 * (average[0] - average[1])
    else:
        b0 = xp.zeros_like(average[0])
    return xp.concatenate([b0.astype(phasors.dtype)[None], phasors])


def saturated(images: Array, *, full_scale: float = 4095) -> Array:
    """Say which pixels are at the end of their scale in any image.

    Parameters
    ----------
    images : array, shape (N, ...)
        Raw images.
    full_scale : float
        Largest value that the sensor gives; 4095 for 12 bits.

    Returns
    -------
    boolean array, shape (...)
    """
    images = as_array(images)
    return (images >= full_scale).any(axis=0)


def _zeroth_images(zeroth: str, phases: int) -> int:
    return phases if zeroth == "low-frequency" else ZEROTH_IMAGES[zeroth]


def takes_first(images: Array | Sequence[Array], takes: int, phases: int = 4) -> Array:
    """Bring all accepted layouts to (takes, images a take, ...)."""
    if takes < 1:
        raise ParameterError("takes", takes, ">= 1")
    stack: Array = np.stack(images) if isinstance(images, Sequence) else as_array(images)
    if stack.ndim == 5:
        if stack.shape[2] != phases:
            expected = f"(takes, F, {phases}, H, W)"
            raise ShapeError("images", f"of shape {tuple(stack.shape)}", expected)
        takes = stack.shape[0]
        stack = stack.reshape((-1, *stack.shape[3:]))
    if stack.ndim < 1 or stack.shape[0] == 0 or stack.shape[0] % takes:
        expected = f"a multiple of the {takes} takes"
        raise ShapeError("images", f"of shape {tuple(stack.shape)}", expected)
    return stack.reshape((takes, stack.shape[0] // takes, *stack.shape[1:]))


def _real(images: Array) -> Array:
    """Return images as reals that hold 16 bits and their differences exactly."""
    if np.dtype(images.dtype).kind == "f" and np.dtype(images.dtype).itemsize >= 4:
        return images
    return images.astype(namespace(images).float32)
