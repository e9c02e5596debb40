"""Pixels that do not do what the others do: find them in dark and lit images, and replace them."""

import numpy as np

from transientcam_moments.arrays import Array, as_array
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
    stack = as_array(images)
    mask = checked_mask(bad, tuple(stack.shape[-2:]))
    if not mask.any() or mask.all():
        return stack
    filled = np.array(stack, dtype=stack.dtype if stack.dtype.kind in "fc" else np.float32)
    flat = filled.reshape((*filled.shape[:-2], mask.size))
    flat[..., np.flatnonzero(mask)] = Replacement(mask).values(flat)
    return filled


def checked_mask(bad: Array, shape: tuple[int, ...]) -> Array:
    """Return ``bad`` if it is a mask of images of this shape (H, W), else raise a ShapeError."""
    mask = np.asarray(bad)
    if mask.ndim != 2 or mask.shape != shape or mask.dtype != bool:
        raise ShapeError("bad", f"{mask.dtype} of shape {mask.shape}", f"boolean of shape {shape}")
    return mask


class Replacement:
    """What stands in for the bad pixels of one mask; see `fill_bad_pixels`.

    Parameters
    ----------
    bad : boolean array, shape (H, W)
        Which pixels to replace: some, but not all.

    Attributes
    ----------
    places : integer array, shape (B,)
        The bad pixels in a flat image.
    """

    def __init__(self, bad: Array) -> None:
        height, width = bad.shape
        self.places = np.flatnonzero(bad)
        y, x = np.nonzero(bad)
        beside = np.array(_AROUND)[:, :, None] + np.stack([y, x])
        inside = ((beside >= 0) & (beside < [[height], [width]])).all(axis=1)
        flat = np.where(inside, beside[:, 0] * width + beside[:, 1], self.places)
        self._near = np.unique(np.append(flat, self.places))
        self._own = np.searchsorted(self._near, self.places)
        neighbours = np.searchsorted(self._near, flat)
        self._rounds: list[tuple[Array, Array, Array]] = []
        left = bad.ravel()[self._near]
        while left.any():
            usable = inside & ~left[neighbours]
            rim = usable.any(axis=0) & left[self._own]
            self._rounds.append((self._own[rim], neighbours[:, rim], usable[:, rim]))
            left[self._own[rim]] = False

    def values(self, images: Array) -> Array:
        """Return the values (..., B) of the bad pixels of flat images (..., H W).

        Real or complex like the images; integers become float32.
        """
        near = images[..., self._near]
        if near.dtype.kind not in "fc":
            near = near.astype(np.float32)
        for rim, neighbours, usable in self._rounds:
            total = np.zeros((*near.shape[:-1], rim.size), dtype=near.dtype)
            for beside, there in zip(neighbours, usable, strict=True):
                total += np.where(there, near[..., beside], 0)
            near[..., rim] = (total / usable.sum(axis=0)).astype(near.dtype)
        return near[..., self._own]


def _deviations(image: Array) -> Array:
    """Return how far each pixel is from the median, in robust standard deviations."""
    values = np.asarray(image, dtype=float)
    distance = values - np.nanmedian(values)
    spread = _NORMAL_MAD * np.nanmedian(np.abs(distance))
    # a rounding to whole digits alone has the deviation 1 / sqrt(12)
    return np.nan_to_num(distance / max(spread, 1 / np.sqrt(12)))
