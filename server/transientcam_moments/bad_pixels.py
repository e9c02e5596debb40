"""Pixels that do not do what the others do: find them in dark and lit images, and replace them."""

import numpy as np

from transientcam_moments._arrays import Array, as_array
from transientcam_moments.errors import ShapeError

OUTLIER_FACTOR = 12.0
DEAD_FRACTION = 0.1
_NORMAL_MAD = 1.4826  # standard deviations in the median absolute deviation of a normal variable
_AROUND = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dy or dx]


def find_bad_pixels(
    *,
    dark: Array | None = None,
    dark_deviation: Array | None = None,
    brightness: Array | None = None,
    outlier_factor: float = OUTLIER_FACTOR,
    dead_fraction: float = DEAD_FRACTION,
) -> Array:
    """Say which pixels are hot, stuck, noisy or dead.

    Parameters
    ----------
    dark : array, shape (H, W), optional
        Mean of images without light. Pixels far from the typical one are hot or stuck.
    dark_deviation : array, shape (H, W), optional
        Standard deviation over those images. Pixels far above the typical one are noisy.
    brightness : array, shape (H, W), optional
        Zeroth moment of a surface that lights all pixels. Those with next to none are dead.
    outlier_factor : float
        How far is far, in robust standard deviations over the pixels (their median absolute
        deviation, scaled to a normal distribution's).
    dead_fraction : float
        Share of the typical brightness below which a pixel is dead.

    Returns
    -------
    boolean array, shape (H, W)
        Also true where an image is not finite.

    Raises
    ------
    ShapeError
        When no image is given, or they have different shapes or other than two axes.

    Notes
    -----
    The spread of dark levels is taken to be at least a digit, so that a sensor with equal pixels
    does not call every other digit an outlier.
    """
    images = [as_array(each) for each in (dark, dark_deviation, brightness) if each is not None]
    if not images or images[0].ndim != 2 or any(each.shape != images[0].shape for each in images):
        found = ", ".join(str(tuple(each.shape)) for each in images) or "none"
        raise ShapeError("images", f"of shape {found}", "one to three of the same shape (H, W)")
    bad = np.zeros(images[0].shape, dtype=bool)
    for image in images:
        bad |= ~np.isfinite(np.asarray(image))
    if dark is not None:
        bad |= np.abs(_deviations(dark)) > outlier_factor
    if dark_deviation is not None:
        bad |= _deviations(dark_deviation) > outlier_factor
    if brightness is not None:
        bad |= ~(np.asarray(brightness) > dead_fraction * np.nanmedian(brightness))
    return bad


def fill_bad_pixels(images: Array, bad: Array) -> Array:
    """Replace bad pixels by the mean of their good neighbours, of eight.

    Parameters
    ----------
    images : array, shape (..., H, W)
        Images of any real or complex type; integers become float32.
    bad : boolean array, shape (H, W)
        Which pixels to replace.

    Returns
    -------
    array, shape (..., H, W)
        The images themselves when nothing has to be replaced. A cluster is filled from its rim
        inwards; where every pixel is bad, nothing is replaced.

    Raises
    ------
    ShapeError
        When the shapes do not fit.
    """
    stack, mask = as_array(images), np.asarray(bad)
    if mask.ndim != 2 or tuple(stack.shape[-2:]) != mask.shape or mask.dtype != bool:
        found = f"{mask.dtype} of shape {mask.shape}"
        raise ShapeError("bad", found, f"boolean of shape {tuple(stack.shape[-2:])}")
    if not mask.any() or mask.all():
        return stack
    filled = np.array(stack, dtype=stack.dtype if stack.dtype.kind in "fc" else np.float32)
    left = mask.copy()
    while left.any():
        y, x = np.nonzero(left)
        total = np.zeros((*filled.shape[:-2], y.size), dtype=filled.dtype)
        count = np.zeros(y.size, dtype=np.int64)
        for dy, dx in _AROUND:
            there = (y + dy >= 0) & (y + dy < mask.shape[0])
            there &= (x + dx >= 0) & (x + dx < mask.shape[1])
            at = np.where(there, y + dy, 0), np.where(there, x + dx, 0)
            there &= ~left[at]
            total += np.where(there, filled[..., at[0], at[1]], 0)
            count += there
        rim = count > 0
        filled[..., y[rim], x[rim]] = (total[..., rim] / count[rim]).astype(filled.dtype)
        left[y[rim], x[rim]] = False
    return filled


def _deviations(image: Array) -> Array:
    """Return how far each pixel is from the median, in robust standard deviations."""
    values = np.asarray(image, dtype=float)
    distance = values - np.nanmedian(values)
    spread = _NORMAL_MAD * np.nanmedian(np.abs(distance))
    # a rounding to whole digits alone has the deviation 1 / sqrt(12)
    return np.nan_to_num(distance / max(spread, 1 / np.sqrt(12)))
