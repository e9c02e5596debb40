"""From raw images to moments: four-bucket sampling and the zeroth moment (Sec. 3.1 and 4.3)."""

from collections.abc import Sequence

import numpy as np

from transientcam_moments._arrays import (
    MAX_HARMONICS,
    Array,
    as_array,
    chosen,
    namespace,
    squared,
    to_complex,
)
from transientcam_moments._kernels import accelerated
from transientcam_moments.errors import ParameterError, ShapeError
from transientcam_moments.takes import average_takes

ZEROTH_IMAGES = {"low-frequency": 4, "on-off": 2, "estimated": 0}
"""Images that each way to measure b_0 costs."""


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


def measure(
    images: Array | Sequence[Array],
    *,
    zeroth: str,
    takes: int = 1,
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
    stack = takes_first(images, takes)
    harmonics_of(stack.shape[1], zeroth)
    return _measure(average_takes(stack).images, zeroth)


def harmonics_of(images: int, zeroth: str) -> int:
    """Return m of a take of so many images.

    Raises
    ------
    ShapeError
        When the number of images is none that such a capture has.
    """
    m, rest = divmod(images - ZEROTH_IMAGES[zeroth], 4)
    if rest or not 1 <= m <= MAX_HARMONICS:
        expected = f"{ZEROTH_IMAGES[zeroth]} + 4 m of them a take, m in 1..32, for {zeroth!r}"
        raise ShapeError("images", f"{images} images a take", expected)
    return m


@accelerated("measure", order=lambda images, zeroth: harmonics_of(len(images), zeroth), of="H")
def _measure(images: Array, zeroth: str) -> Array:
    """Planar statement of `measure` for the images (N, ...) of one take."""
    average = _real(images)
    xp = namespace(average)
    m = harmonics_of(len(images), zeroth)
    phasors = average[ZEROTH_IMAGES[zeroth] :]
    phasors = four_bucket(phasors.reshape((m, 4, *phasors.shape[1:])))
    if zeroth == "low-frequency":
        low = four_bucket(average[None, :4])[0]
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


def takes_first(images: Array | Sequence[Array], takes: int) -> Array:
    """Bring all accepted layouts to (takes, images a take, ...)."""
    if takes < 1:
        raise ParameterError("takes", takes, ">= 1")
    stack: Array = np.stack(images) if isinstance(images, Sequence) else as_array(images)
    if stack.ndim == 5:
        if stack.shape[2] != 4:
            raise ShapeError("images", f"of shape {tuple(stack.shape)}", "(takes, F, 4, H, W)")
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
