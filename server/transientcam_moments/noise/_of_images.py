"""The noise of raw images from the images themselves.

Those of one frequency are offset + amplitude cos(phase - theta): what of them is orthogonal to
these three, such as I_0 - I_90 + I_180 - I_270, is noise alone, whatever stands before the camera.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from transientcam_moments.arrays import Array
from transientcam_moments.noise._ambient import ambient_light
from transientcam_moments.noise._sensor import ROUNDING_VARIANCE, ImageNoise, Sensor

_IMAGES, _LEAST_PIXELS = 1 << 17, 1024
"""Values of images that are looked at, for 1 %, in pixels spread evenly; but no fewer of them."""
_LEAST: Final = 64
"""Pixels, below which nothing is said."""
_CLIPPED: Final = 3.0
"""Deviations beyond which a sample is no noise (motion, an image out of step)."""
_KEPT: Final = 0.97334  # of a normal variable's variance within so many of its deviations
_ROUNDS: Final = 5
_BINS: Final = 16
_LEAST_SHARE: Final = 1 / 9
_HALF_NORMAL: Final = 0.6745  # median of the modulus of a normal variable of deviation 1
_NO_GROWTH: Final = 1e-9
_WHOLE: Final = 1e-6  # sum of the phasors of phases that are spread evenly, at most
_BRIGHTENS: Final = 0.5
"""Growth of an offset with half of b_0, from which on it holds the light; tap A less B has none."""


class CapturedImages(NamedTuple):
    """Raw images that moments are measured from, for what only they tell.

    Attributes
    ----------
    takes : array, shape (T, N, ...)
        As `measure` takes them.
    phases_rad : sequence of float
        Of the images of each frequency.
    first : int
        How many images of a take come before those at the phases.
    saturated_pixels, bad_pixels : boolean array, shape (...), optional
        Pixels that are not used, nor those beside saturated ones.
    left_out : boolean array, shape (T, N), optional
        Images that are not as they were captured: none of that frequency and take is used.
    sigma_px : float
        With which the moments are smoothed.
    variance : array, shape (...), optional
        Of moments over that of images as they are captured, see `images.Recovered`.
    """

    takes: Array
    phases_rad: Sequence[float]
    first: int = 0
    saturated_pixels: Array | None = None
    bad_pixels: Array | None = None
    left_out: Array | None = None
    sigma_px: float = 0.0
    variance: Array | None = None

    def ambient(self, brightness: Array, sensor: Sensor | ImageNoise) -> Array | None:
        """Return light that is not the camera's, by `ambient_light` of the first frequency."""
        if abs(np.exp(1j * np.asarray(self.phases_rad)).sum()) > _WHOLE:
            return None
        return ambient_light(
            self.takes[0, self.first : self.first + len(self.phases_rad)],
            brightness,
            sensor,
            sigma_px=self.sigma_px,
            bad_pixels=self.bad_pixels,
        )


def image_noise(captured: CapturedImages, brightness: Array) -> ImageNoise | None:
    """Measure the noise of the images of one capture, of which b_0 is known (...), in DN.

    Returns
    -------
    ImageNoise or None
        None where the capture does not tell: three images of a single frequency and take, less
        than `_LEAST` pixels with light, or no noise at all.

    Notes
    -----
    A weighted least squares fit, whose weights are its own, of squares within three of its
    deviations. Offsets are the same at all frequencies: they serve where there are but three
    phases. Several takes are held against their mean; even harmonics turn with twice the phase.
    """
    takes, phases_rad, first, saturated_pixels, bad_pixels, left_out, *_ = captured
    steps = len(phases_rad)
    stack = np.asarray(takes).reshape((len(takes), takes.shape[1], -1))
    light = np.asarray(brightness).reshape(-1)
    usable: NDArray[np.bool_] = np.isfinite(light) & (light > 0)
    if saturated_pixels is not None:
        full = np.asarray(saturated_pixels)
        near = [np.roll(full, by, axis) for axis in range(full.ndim) for by in (-1, 0, 1)]
        usable &= ~np.logical_or.reduce(near).reshape(-1)
    if bad_pixels is not None:
        usable &= ~np.asarray(bad_pixels).reshape(-1)
    places = np.flatnonzero(usable)
    if places.size < _LEAST:
        return None
    most = max(_LEAST_PIXELS, _IMAGES // (stack.shape[0] * stack.shape[1]))
    places = places[:: max(1, places.size // most)]
    # what turns with the light is read of the pixel beside, whose noise is another one
    both = np.stack([places, np.minimum(places + 1, light.size - 1)])
    images = stack[:, first:, both].astype(float)
    images = images.reshape((len(stack), -1, steps, *both.shape))
    whole: NDArray[np.bool_] = np.ones(images.shape[:2], dtype=bool)
    if left_out is not None:
        gone = np.asarray(left_out, dtype=bool)[:, first:].reshape((*whole.shape, steps))
        whole = ~np.logical_or.reduce(gone, axis=2)
    samples, known, signal, dark_dn = _samples(images, light[places] / 2, whole, phases_rad)
    if not samples.size or not np.isfinite(samples).all():
        return None
    rounded = bool((images == np.rint(images)).all())
    least = ROUNDING_VARIANCE if rounded else 1e-9 * float((samples**2).mean())
    return ImageNoise(*_fitted(samples, known, signal, least), dark_dn) if least > 0 else None


def _samples(
    images: Array, half: Array, whole: Array, phases_rad: Sequence[float]
) -> tuple[Array, Array, Array, float]:
    """Return samples (S, P) with the variance of an image, and what may be in them beside noise.

    That is (S, K, P): a constant, the signal, and what turns with twice the phase. Then the signal
    (P,) of the images in DN, and the offset that stands for none.
    """
    model = np.stack([np.ones(len(phases_rad)), np.cos(phases_rad), np.sin(phases_rad)], axis=1)
    solved = np.linalg.pinv(model)
    own, beside = images[..., 0, :], images[..., 1, :]
    offset = solved[0] @ own
    phasor = (solved[1] + 1j * solved[2]) @ beside
    signal, dark_dn = _signal(offset[whole].mean(axis=0) if whole.any() else offset[0, 0], half)
    basis = np.linalg.svd(model)[0].T[np.linalg.matrix_rank(model) :]
    found, turning = [np.empty((0, half.size))], [np.empty((0, half.size), dtype=complex)]
    if not len(basis) and len(images) == 1 and images.shape[1] > 1:
        across = np.linalg.svd(np.ones((images.shape[1], 1)))[0].T[1:]
        found.append(across @ offset[0] / np.linalg.norm(solved[0]))
        turning.append(np.zeros_like(found[-1], dtype=complex))
    elif len(basis) or len(images) > 1:
        least, basis = (1, basis) if len(basis) else (2, np.eye(len(phases_rad)))
        for at, used in enumerate(whole.T):
            count = np.count_nonzero(used)
            if count < least:
                continue
            left = basis @ own[used, at]
            if count > 1:
                left = (left - left.mean(axis=0)) * np.sqrt(count / (count - 1))
            z = phasor[used, at].mean(axis=0)
            found.append(left.reshape((-1, half.size)))
            turning.append(np.broadcast_to(z * z / np.maximum(abs(z), _NO_GROWTH), found[-1].shape))
    samples: Array = np.concatenate(found)
    twice: Array = np.concatenate(turning)
    known = np.stack(
        [0 * samples + 1, 0 * samples + signal, np.real(twice), np.imag(twice)], axis=1
    )
    return samples, known, signal, dark_dn


def _signal(offset: Array, half: Array) -> tuple[Array, float]:
    """Return the signal (P,) and the offset that stands for none, of half of b_0."""
    grown = np.cov(half, offset)
    if grown[0, 1] < _BRIGHTENS * grown[0, 0]:
        return half, float(offset.max())
    dim = offset <= np.quantile(offset, 0.25)  # where an error of b_0, as by motion, is small
    dark_dn = float(np.quantile((offset - half)[dim], 0.1))
    return np.maximum(offset - dark_dn, 0), dark_dn


def _fitted(samples: Array, known: Array, signal: Array, least: float) -> tuple[float, float]:
    """Return the variance without signal, and its growth with it."""
    # to begin with, the line of Theil and Sen through medians, whatever a quarter of them are
    bins = np.array_split(np.argsort(signal), _BINS)
    middle = np.array([np.median(signal[each]) for each in bins])
    level = (np.array([np.median(abs(samples[:, each])) for each in bins]) / _HALF_NORMAL) ** 2
    first, second = np.triu_indices(_BINS, 1)
    apart = np.maximum(middle[second] - middle[first], _NO_GROWTH)
    growth = max(np.median((level[second] - level[first]) / apart), 0.0)
    variance = np.maximum(growth * signal + np.median(level - growth * middle), least)
    for each, found in zip(bins, level, strict=True):  # of light with even harmonics it is no line
        variance[each] = np.maximum(variance[each], _LEAST_SHARE * found)
    left, line = samples, (least, 0.0)
    for _ in range(_ROUNDS):
        weight = (abs(left) < _CLIPPED * np.sqrt(variance)) / variance
        weighted = known * weight[:, None]
        inverse = np.linalg.pinv(weighted @ known.swapaxes(1, 2), hermitian=True)
        found = inverse @ (weighted @ samples[..., None])
        left = samples - (found.swapaxes(1, 2) @ known)[:, 0]
        noise = left**2 < _CLIPPED**2 * variance
        count, squares = noise.sum(axis=0), (noise * left**2).sum(axis=0) / _KEPT
        line = _line(signal, squares / variance**2, count / variance**2, least)
        variance = line[0] + line[1] * signal
    return line


def _line(signal: Array, squares: Array, weight: Array, least: float) -> tuple[float, float]:
    """Fit a line to weighted squares that neither falls nor begins below the least."""
    total, middle = weight.sum(), (weight * signal).sum() / max(weight.sum(), 1e-300)
    mean = squares.sum() / max(total, 1e-300)
    spread = (weight * (signal - middle) ** 2).sum()
    growth = ((signal - middle) * squares).sum() / spread if spread > 0 else 0.0
    growth = min(max(growth, 0.0), (mean - least) / middle if middle > 0 else 0.0)
    growth = max(growth, _NO_GROWTH)
    return float(max(mean - growth * middle, least)), float(growth)
