"""The cumulative density in closed form, and by quadrature where that is ill-conditioned."""

from typing import Any

import numpy as np

from transientcam_moments._dispatch import accelerated
from transientcam_moments.arrays import (
    Array,
    bank,
    flat_planes,
    namespace,
    parts,
    phases,
    squared,
    to_complex,
)
from transientcam_moments.moment_problem import _maxima as maxima
from transientcam_moments.moment_problem._levinson import Coefficients, from_reflection, moments_of

_BLOCK_VALUES = 1 << 16
_TOLERANCE = 1e-11  # of the closed form, relative to b_0, before quadrature takes over
_LEVELS = 60
_NODES = 12


def cumulative(coefficients: Coefficients, phase_rad: Array) -> Array:
    """Integrate the density of every pixel from phase 0 to given phases.

    Parameters
    ----------
    coefficients : Coefficients
        Of order m.
    phase_rad : array, shape (T,)
        Upper limits phi in radian, any order and any turn; a full turn adds b_0.

    Returns
    -------
    array, shape (T, ...)
        In the unit of b_0. Computed in double precision inside (with NumPy; with JAX in that of
        the coefficients) and returned in the precision of the coefficients.

    Raises
    ------
    ShapeError
        When `phase_rad` has more than one axis or isn't real.

    Notes
    -----
    With the poles p_l of the density and b_k = sum_l C_l p_l^k it is [b_0 phi + 2 Im(S(phi) -
    S(0))] / (2 pi), S(x) = sum_l C_l log(1 - p_l exp(-i x)); the paper uses 1e5-point quadrature
    (Sec. 6.1). Where poles nearly coincide the C_l cancel each other. There Gauss-Legendre
    quadrature on intervals that shrink towards the poles takes over. JAX arrays under `jit`
    always get the closed form.
    """
    a, reflection = flat_planes(coefficients.polynomial), flat_planes(coefficients.reflection)
    phase, error = phases(phase_rad, like=reflection), coefficients.error
    found = _integrated(a, reflection, error.reshape(-1), phase)
    return found.reshape((phase.shape[0], *error.shape))


@accelerated("cumulative")
def _integrated(a: Array, reflection: Array, error: Array, phase: Array) -> Array:
    b0 = Coefficients(error, a, reflection).brightness
    if namespace(reflection) is not np:
        return _closed_form(from_reflection(b0, reflection), phase)[0]
    exact = from_reflection(b0.astype(np.float64), reflection.astype(np.complex128))
    out = np.empty((phase.shape[0], b0.size), b0.dtype)
    pixels = max(128, _BLOCK_VALUES // max(1, phase.shape[0]))
    for start in range(0, b0.size, pixels):
        part = slice(start, start + pixels)
        out[:, part] = _with_fallback(Coefficients(*(x[..., part] for x in exact)), phase)
    return out


def _with_fallback(coefficients: Coefficients, phase: Array) -> Array:
    out, error = _closed_form(coefficients, phase)
    ill = np.flatnonzero(~(error <= _TOLERANCE) & (coefficients.error > 0))
    if ill.size:
        out[:, ill] = _quadrature(Coefficients(*(x[..., ill] for x in coefficients)), phase)
    return out


def _closed_form(coefficients: Coefficients, phase: Array) -> tuple[Array, Array]:
    """Planar statement of the closed form; also returns an estimate of its relative error."""
    xp, dtype = namespace(coefficients.polynomial), coefficients.error.dtype
    with np.errstate(all="ignore"):
        b0, terms, error = expansion(coefficients)
        # whole turns are separated first: close to a sharp peak 2 pi + x isn't quite x
        turns = xp.floor(phase / (2 * np.pi))
        rest = (phase - 2 * np.pi * turns)[:, None].astype(dtype)
        backwards = to_complex(xp.cos(rest), -xp.sin(rest))
        return until(b0, terms, turns[:, None].astype(dtype), rest, backwards), error


def expansion(coefficients: Coefficients) -> tuple[Array, list[tuple[Any, ...]], Array]:
    """Return b_0; p_l, C_l and log(1 - p_l) for each pole; and the error as of `_shares`."""
    b = moments_of(coefficients)
    poles = disc_roots(coefficients.polynomial)
    shares, error = _shares(poles, coefficients, b)
    return b[0].real, list(zip(poles, shares, map(_logarithm, poles), strict=True)), error


def until(
    b0: Array, terms: list[tuple[Any, ...]], turns: Array, rest: Array, backwards: Array
) -> Array:
    """Integrate from 0 to whole turns and the rest of one, whose exp(-i rest) is given."""
    xp = namespace(b0)
    total = rest * b0
    for pole, share, (angle_0, stretch_0) in terms:
        # S(phi) - S(0), S(x) = sum_l C_l log(1 - p_l exp(-i x))
        angle, stretch = _logarithm(pole * backwards)
        total = total + 2 * (share.real * (angle - angle_0))
        total = total + 2 * (share.imag * (stretch - stretch_0))
    return xp.where(b0 > 0, total / (2 * np.pi) + turns * b0, 0 * total)


def _logarithm(w: Array) -> tuple[Array, Array]:
    """Return imaginary and real part of log(1 - w), |w| < 1, precise also for tiny w."""
    xp = namespace(w)
    above = squared(w) - 2 * w.real  # |1 - w|^2 - 1
    near = 1 - w  # in the right half plane
    stretch = xp.where(above > -0.5, xp.log1p(xp.maximum(above, -0.5)), xp.log(squared(near)))
    return xp.arctan2(near.imag, near.real), stretch / 2


def _shares(poles: list[Array], coefficients: Coefficients, b: Array) -> tuple[list[Array], Array]:
    """Return the C_l of b_k = sum_l C_l p_l^k and an estimate of their error relative to b_0.

    Notes
    -----
    There are two ways. As residues of the density, C_l = E p_l^{m-1} / (p'(p_l) prod_j (1 -
    conj(p_j) p_l)), they have the light in a sharp peak to no more digits than the distance of its
    pole from the circle has. As solution of the equations for k < m, C_l = sum_k q_k b_k / p'(p_l)
    with p(z) / (z - p_l) = sum_k q_k z^k, they suffer twice where poles nearly coincide. Each
    pixel takes the better one.
    """
    a = coefficients.polynomial
    xp = namespace(a)
    m = a.shape[0] - 1
    sizes = [xp.sqrt(squared(plane)) for plane in a]
    residues, solutions = [], []
    residue_error, solution_error = 0 * coefficients.error, 0 * coefficients.error
    for index, pole in enumerate(poles):
        quotient = a[0]
        solution = quotient * b[m - 1]
        reach = xp.sqrt(squared(pole))
        size = sizes[0] * reach + sizes[1]
        for k in range(1, m):
            quotient = quotient * pole + a[k]
            solution = solution + quotient * b[m - 1 - k]
            size = size * reach + sizes[k + 1]
        slope, near = xp.ones_like(pole), 0 * size
        mirrored = 1 - pole.conj() * pole
        distance = mirrored.real
        residue = coefficients.error
        for other_index, other in enumerate(poles):
            if other_index != index:
                slope = slope * (pole - other)  # p'(p_l), of which close poles cancel each other
                residue = residue * pole
                mirrored = mirrored * (1 - other.conj() * pole)
                near = near + 1 / xp.sqrt(squared(pole - other))
        inverse = slope.conj() / squared(slope)
        residues.append(residue * inverse * mirrored.conj() / squared(mirrored))
        solutions.append(solution * inverse)
        rounding = size * xp.sqrt(squared(inverse))
        # log(1 - w) is about w: faint poles count as much as they reach
        weight = reach * xp.sqrt(squared(residues[-1])), reach * xp.sqrt(squared(solutions[-1]))
        residue_error = residue_error + weight[0] + b[0].real * rounding / distance
        solution_error = solution_error + weight[1] * (1 + rounding * near)
    better = residue_error <= solution_error
    shares = [xp.where(better, *pair) for pair in zip(residues, solutions, strict=True)]
    eps = float(np.finfo(b[0].real.dtype).eps)
    return shares, eps * xp.where(better, residue_error, solution_error) / b[0].real


def _quadrature(coefficients: Coefficients, phase: Array) -> Array:
    """Integrate by Gauss-Legendre rules on intervals that halve towards the angle of each pole."""
    a = coefficients.polynomial
    with np.errstate(all="ignore"):
        angles = np.angle(np.stack(disc_roots(a))) % (2 * np.pi)
    steps = np.pi * 0.5 ** np.arange(_LEVELS)
    offsets = np.concatenate([-steps, [0.0], steps[::-1]])
    marks = (angles[:, None] + offsets[:, None]).reshape(-1, a.shape[1]) % (2 * np.pi)
    turns = np.floor(phase / (2 * np.pi))
    rest = np.asarray(phase - 2 * np.pi * turns, dtype=float)
    wanted = np.broadcast_to(rest[:, None], (rest.size, a.shape[1]))
    ends = np.zeros((1, a.shape[1]))
    knots = np.sort(np.concatenate([ends, marks, wanted, ends + 2 * np.pi]), axis=0)
    running = np.concatenate([ends, np.cumsum(_panels(a, knots), axis=0)])
    out = np.empty(wanted.shape)
    for pixel in range(a.shape[1]):  # few pixels come here
        at = np.searchsorted(knots[:, pixel], rest)
        out[:, pixel] = running[at, pixel] / running[-1, pixel] + turns
    return out * coefficients.brightness  # which the integral over the turn is known to be


def _panels(a: Array, knots: Array) -> Array:
    """Integrate 1 / |sum conj(a_j) e^{ij phi}|^2 between neighbouring knots (K, P), (K - 1, P)."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    centre, half = (knots[1:] + knots[:-1]) / 2, (knots[1:] - knots[:-1]) / 2
    total: Any = 0.0
    for node, weight in zip(nodes, weights, strict=True):
        z = np.exp(-1j * (centre + half * node))
        value = np.broadcast_to(a[-1], z.shape)
        for plane in a[-2::-1]:
            value = value * z + plane
        total = total + weight / squared(value)
    return total * half


def disc_roots(a: Array) -> list[Array]:
    """Find the roots of z^m + a_1 z^{m-1} + ... + a_m: the poles of a maximum entropy density.

    Parameters
    ----------
    a : complex array, shape (m + 1, P)
        a_0 = 1, a_1 .. a_m of predictor polynomials; all roots lie inside the unit circle.

    Returns
    -------
    list of m complex planes
    """
    order = (0,) * (a.shape[0] - 1)
    re, im = parts(a)
    real, imag = bank(re[0], order, 0), bank(re[0], order, 0)
    with np.errstate(all="ignore"):
        maxima.poles(order, maxima.start_angles(len(order), re[0].dtype), re, im, real, imag)
    return [to_complex(x, y) for x, y in zip(real, imag, strict=True)]
