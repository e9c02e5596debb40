"""The maximum entropy density at given phases (Theorem 1, Eq. 2)."""

from collections.abc import Callable

import numpy as np

from transientcam_moments._dispatch import accelerated, on_threads
from transientcam_moments.arrays import (
    Array,
    chosen,
    flat_planes,
    namespace,
    parts,
    phases,
    real_type,
)
from transientcam_moments.moment_problem._evaluation import height
from transientcam_moments.moment_problem._levinson import Coefficients
from transientcam_moments.moment_problem._toeplitz import least_modulus

_BLOCK_VALUES = 1 << 18


def density(
    coefficients: Coefficients,
    phase_rad: Array,
    *,
    evaluation: str = "modulus",
    threads: int | None = None,
) -> Array:
    """Evaluate the density h of every pixel at given phases.

    Parameters
    ----------
    coefficients : Coefficients
        Of order m, from `levinson` or `from_reflection`.
    phase_rad : array, shape (T,)
        Phases phi in radian, any order and any turn; a single number counts as T = 1.
    evaluation : {"modulus", "fourier"}
        Evaluate the denominator as the squared modulus of a polynomial, whose relative error near
        a peak of relative depth d grows like eps / sqrt(d), or as a real Fourier series, which is
        half the work and errs like eps / d.
    threads : int, optional
        How many threads a compiled kernel uses; all cores when left out.

    Returns
    -------
    array, shape (T, ...)
        h in the unit of b_0 per radian, >= 0. Per second: g(tau) = 2 pi f h(2 pi f tau).

    Raises
    ------
    ParameterError
        For another `evaluation`, or less than one thread.
    ShapeError
        When `phase_rad` has more than one axis or isn't real.

    Notes
    -----
    Eq. (2) with B^-1 e_0 = a / E. Nothing is larger than b_0 / (2 pi eps): peaks narrower than
    rounding resolves have no meaningful height.
    """
    chosen("evaluation", evaluation, ("modulus", "fourier"))
    error, a = coefficients.error, coefficients.polynomial
    phase = phases(phase_rad, like=a)
    planes = flat_planes(a), flat_planes(coefficients.reflection), error.reshape(-1), phase
    spread = on_threads(threads)
    out = _by_modulus(*planes, spread=spread) if evaluation == "modulus" else _by_series(*planes)
    return out.reshape((phase.shape[0], *error.shape))


@accelerated("density")
def _by_modulus(a: Array, reflection: Array, error: Array, phase: Array) -> Array:
    return _by_blocks(_density, a, error, modulus_floor(reflection), phase)


def _by_series(a: Array, reflection: Array, error: Array, phase: Array) -> Array:
    return _by_blocks(_density_fourier, a, error, modulus_floor(reflection), phase)


def modulus_floor(reflection: Array) -> Array:
    """Return the smallest squared modulus above rounding."""
    return least_modulus((0,) * reflection.shape[0], *parts(reflection))


def _by_blocks(
    fill: Callable[..., Array], planes: Array, error: Array, floor: Array, phase: Array
) -> Array:
    """Fill blocks of pixels that stay in cache with all their phases."""
    xp = namespace(planes)
    if xp is not np:
        return fill(planes, error, floor, phase)
    out = np.empty((phase.shape[0], planes.shape[1]), real_type(planes))
    pixels = max(256, _BLOCK_VALUES // max(1, phase.shape[0]))
    for start in range(0, planes.shape[1], pixels):
        part = slice(start, start + pixels)
        out[:, part] = fill(planes[:, part], error[part], floor[part], phase)
    return out


def _density(a: Array, error: Array, floor: Array, phase: Array) -> Array:
    """Planar statement of Eq. (2): two real matrix products, then a reciprocal."""
    xp = namespace(a)
    angles = phase[:, None] * xp.arange(a.shape[0])
    cos, sin = xp.cos(angles).astype(error.dtype), xp.sin(angles).astype(error.dtype)
    # conj(a_j) exp(i j phi) = (re cos + im sin) + i (re sin - im cos)
    parts = xp.concatenate([a.real, a.imag])
    real = xp.concatenate([cos, sin], axis=1) @ parts
    imag = xp.concatenate([sin, -cos], axis=1) @ parts
    with np.errstate(all="ignore"):
        # Eq. (2): e_0* B^-1 e_0 = 1 / E and e_0* B^-1 s(phi) = sum_j conj(a_j) exp(i j phi) / E
        return height(error / (2 * np.pi), floor, real, imag)


def _density_fourier(a: Array, error: Array, floor: Array, phase: Array) -> Array:
    """Evaluate |sum conj(a_j) e^{ij phi}|^2 = r_0 + 2 Re sum_k r_k e^{ik phi}."""
    xp = namespace(a)
    size = a.shape[0]
    r = [sum(a[j] * a[j + k].conj() for j in range(size - k)) for k in range(size)]
    angles = phase[:, None] * xp.arange(size)
    cos, sin = xp.cos(angles).astype(error.dtype), xp.sin(angles).astype(error.dtype)
    parts = xp.stack([r[0].real] + [2 * p.real for p in r[1:]] + [-2 * p.imag for p in r[1:]])
    with np.errstate(all="ignore"):
        # the reciprocal of a positive Fourier series, as Sec. 3.3 has it
        series = xp.concatenate([cos, sin[:, 1:]], axis=1) @ parts
        return error / (2 * np.pi) / xp.maximum(series, floor)
