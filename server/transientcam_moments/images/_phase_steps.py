"""From images at any phases to a moment: weights by least squares (Sec. 3.1)."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from transientcam_moments.arrays import Array
from transientcam_moments.errors import ParameterError

FOUR_PHASES_RAD: Final = (0.0, np.pi / 2, np.pi, 3 * np.pi / 2)
"""Four-bucket sampling, in the order of `four_bucket`."""
LEAST_PHASES: Final = 3
SAME_PHASE_RAD: Final = 1e-6
_STEPS: Final = len(FOUR_PHASES_RAD)
_STEP_WEIGHTS: Final = np.array([1, 1j, -1, -1j])


def phase_weights(phase_rad: Array | Sequence[float]) -> Array:
    """Return the weights that make a moment of images at these phases.

    Parameters
    ----------
    phase_rad : array, shape (N,)
        N >= 3, at least three of them different.

    Returns
    -------
    array, shape (N,), complex128
        b = sum_k weight_k I_k. Their sum is 0, so that dark level and ambient light cancel.

    Raises
    ------
    ParameterError
        For less than three different phases.

    Notes
    -----
    Image k holds offset + 1/2 Re(b exp(-i phase_k)), which is linear in Re b, Im b and the offset:
    the weights are two rows of the pseudo-inverse. All images count alike, whatever their shot
    noise: weights by noise that is itself estimated from the images would bias the moments. N
    equidistant phases have 4 / N exp(i phase_k); of 0, 90, 180 and 270 degrees these are exactly
    1, i, -1 and -i.
    """
    phase = np.asarray(phase_rad, dtype=float)
    if phase.ndim != 1 or not np.isfinite(phase).all() or _different(phase) < LEAST_PHASES:
        raise ParameterError("phase_rad", phase.tolist(), "at least three different phases")
    steps = np.rint(phase / (np.pi / 2))
    on_steps = np.allclose(phase, steps * (np.pi / 2), atol=SAME_PHASE_RAD)
    steps = steps.astype(np.int64) % _STEPS
    if on_steps and sorted(steps) == list(range(_STEPS)):
        found: Array = _STEP_WEIGHTS[steps]
        return found
    model = np.stack([np.cos(phase) / 2, np.sin(phase) / 2, np.ones(phase.shape)], axis=1)
    real, imaginary, _ = np.linalg.pinv(model)
    return np.asarray(real + 1j * imaginary)


def is_four_bucket(phase_rad: Array | Sequence[float]) -> bool:
    """Say whether the phases are 0, 90, 180 and 270 degrees, in this order."""
    return len(phase_rad) == _STEPS and all(  # asked of each frame: NumPy takes 20 us longer
        abs(phase - step) <= SAME_PHASE_RAD
        for phase, step in zip(phase_rad, FOUR_PHASES_RAD, strict=True)
    )


def phase_noise(phase_rad: Array | Sequence[float]) -> float:
    """Return the variance of a moment's real part, and of its imaginary, over that of one image.

    Parameters
    ----------
    phase_rad : array, shape (N,)
        As of `phase_weights`.

    Notes
    -----
    2 for four phases and 8 / N for N equidistant ones. It is the mean of both parts, which differ
    where the phases are not equidistant, and for images of equal noise.
    """
    weight = phase_weights(phase_rad)
    return float((weight.real**2 + weight.imag**2).sum() / 2)


def _different(phase: Array) -> int:
    """Return how many of the phases (N,) are different."""
    waves = np.exp(1j * phase)
    apart = abs(waves[:, None] - waves[None, :]) > SAME_PHASE_RAD
    return sum(bool(apart[k, :k].all()) for k in range(len(waves)))
