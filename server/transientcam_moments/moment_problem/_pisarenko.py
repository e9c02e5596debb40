"""Pisarenko's estimate: a uniform part and at most m sharp returns (Sec. 5.1, Theorem 2)."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from transientcam_moments._dispatch import accelerated, on_threads
from transientcam_moments.arrays import (
    Array,
    bank,
    by_blocks,
    in_range,
    in_turn,
    moment_planes,
    namespace,
    parts,
    some,
    summary,
)
from transientcam_moments.moment_problem import (
    _circle as circle,
    _sparse as sparse,
    _toeplitz as toeplitz,
)
from transientcam_moments.moment_problem._eigenvalue import smallest_eigenvalue
from transientcam_moments.moment_problem._levinson import normalised
from transientcam_moments.moment_problem._polishing import polish, residual, size

DIRECT_THRESHOLD = 0.1
"""A return is the direct one when it is the first with this share of the strongest."""
_STEPS = 80  # towards the roots; ten are usual, clusters need more


class Returns(NamedTuple):
    """Sharp returns and a uniform part with the moments of the measurement.

    Attributes
    ----------
    phase_rad : array, shape (m, ...)
        In [0, 2 pi), ascending; NaN in unused slots, which come last.
    weight : array, shape (m, ...)
        Brightness of each return, >= 0; 0 in unused slots.
    uniform : array, shape (...)
        The smallest eigenvalue, brightness of the uniform part; negative where the moments
        contradict each other. The weights and it add up to b_0.
    count : integer array, shape (...)
        Number of returns.
    """

    phase_rad: Array
    weight: Array
    uniform: Array
    count: Array

    def __repr__(self) -> str:
        """State order, pixels and how many returns they have."""
        count = np.asarray(self.count)
        pixels = " x ".join(map(str, count.shape)) or "1"
        numbers, pixels_of = np.unique(count, return_counts=True)
        shares = (
            f"{number} in {share:.1%}"
            for number, share in zip(numbers, pixels_of / max(count.size, 1), strict=True)
        )
        return f"<Returns m = {len(self.weight)}, pixels {pixels}; returns: {', '.join(shares)}>"


class Separation(NamedTuple):
    """Direct and indirect light of each pixel (Sec. 5.1).

    Attributes
    ----------
    direct : array, shape (...)
        Weight of the direct return; 0 where there is none.
    indirect : array, shape (...)
        Sum of the other weights.
    phase_rad : array, shape (...)
        Phase of the direct return; NaN where there is none.
    """

    direct: Array
    indirect: Array
    phase_rad: Array

    def __repr__(self) -> str:
        """State the shapes and spans of its arrays."""
        return summary(self)


def pisarenko(b: Array, *, eigenvalue: Array | None = None, threads: int | None = None) -> Returns:
    """Explain moments by a uniform part and as few returns as there have to be.

    Parameters
    ----------
    b : array, shape (m + 1, ...)
        Trigonometric moments; with b_0 = 0 where it was not measured, the returns are those of
        least total brightness.
    eigenvalue : array, shape (...), optional
        Smallest eigenvalue of `b`, where it is at hand already.
    threads : int, optional
        How many threads a compiled kernel uses; all cores when left out.

    Returns
    -------
    result : `Returns`
        Fewer than m returns where the smallest eigenvalue is multiple; none where there is no
        light or a moment is NaN or infinite.

    Raises
    ------
    ShapeError
        When `b` is not 2 to 33 planes of numbers.
    ParameterError
        For less than one thread.

    Notes
    -----
    Theorem 2. At the smallest eigenvalue lambda Levinson's recursion on B - lambda I ends with an
    error of zero at the order of the smallest singular leading block, which is the number of
    returns; its polynomial is the eigenvector. The weights are 1 / sum_k |Phi_k(z)|^2 / E_k with
    the recursion's polynomials Phi_k, and so never negative.
    """
    planes, trailing = moment_planes(b)
    spread = on_threads(threads)
    phase, weight, uniform, count = _explained(planes, eigenvalue, spread=spread)
    return Returns(
        phase.reshape((phase.shape[0], *trailing)),
        weight.reshape((weight.shape[0], *trailing)),
        uniform.reshape(trailing),
        count.reshape(trailing),
    )


def separate(returns: Returns, threshold: float = DIRECT_THRESHOLD) -> Separation:
    """Separate direct from indirect light.

    Parameters
    ----------
    returns : Returns
        From `pisarenko`.
    threshold : float
        The direct return is the first whose weight is at least this share of the strongest one's,
        0 to 1.

    Returns
    -------
    Separation

    Raises
    ------
    ParameterError
        For a threshold outside of 0 to 1.

    Notes
    -----
    Sec. 5.1: "the first return with a weight above a relative threshold".
    """
    in_range("threshold", threshold, 0.0, 1.0, "0 to 1")
    return Separation(*_separate(returns.weight, returns.phase_rad, threshold))


@accelerated("separate", order=lambda weights, *_: len(weights), of="f")
def _separate(weights: Array, phases_rad: Array, threshold: float) -> tuple[Array, ...]:
    order, one = (0,) * len(weights), namespace(weights).ones_like(weights[0])
    found: tuple[Array, ...] = sparse.separate(
        order, threshold, one, list(phases_rad), list(weights)
    )
    return found


@accelerated("pisarenko")
def _explained(b: Array, eigenvalue: Array | None) -> tuple[Array, ...]:
    """Return phase, weight, uniform and count of flat planes, redone where they are ill."""
    known = () if eigenvalue is None else (eigenvalue.reshape(-1),)
    if namespace(b) is not np:
        return by_blocks(first_returns, b, *known)
    *found, residual = by_blocks(_quick_returns, b, *known)
    noise = float(np.finfo(residual.dtype).eps)
    redo(b, found, np.flatnonzero(residual > sparse.largest_residual(len(b) - 1, noise)), noise)
    return tuple(found)


def _quick_returns(b: Array, uniform: Array | None = None) -> tuple[Array, ...]:
    """Return phase, weight, uniform, count and residual of planes (m + 1, P), as kernels do."""
    order = (0,) * (len(b) - 1)
    with np.errstate(all="ignore"):  # invalid pixels are computed along and stay by themselves
        eigenvalue: Array = uniform
        if uniform is None:
            *relative, scale = normalised(b)
            eigenvalue = scale * smallest_eigenvalue(order, *relative)
        re, im = parts(b)
        re[0] = re[0] + 0 * im[0]
        one, turns = np.ones_like(re[0]), circle.half_turns(len(order), re[0].dtype)
        phase, weight = bank(one, order, 0), bank(one, order, 0)
        noise = float(np.finfo(one.dtype).eps)
        count: Array
        count, residual = sparse.returns(
            order, turns, _STEPS, noise, one, eigenvalue.astype(one.dtype), re, im, phase, weight
        )
    return np.stack(phase), np.stack(weight), eigenvalue, count.astype(np.int32), residual


def first_returns(
    b: Array, uniform: Array | None = None, *, noise: float | None = None
) -> tuple[Array, Array, Array, Array]:
    """Find returns with care: b (m + 1, P) to phase, weight, uniform, count.

    Each number of returns has a polynomial of its own.

    `uniform` is the smallest eigenvalue where it is known, `noise` the precision of the data where
    it isn't that of their type.
    """
    with np.errstate(all="ignore"):  # invalid pixels are computed along and stay by themselves
        re, im, scale = normalised(b)
        if uniform is None:
            eigenvalue = smallest_eigenvalue((0,) * (len(re) - 1), re, im)
        else:
            eigenvalue = namespace(b).where(scale > 0, uniform / scale, 0 * scale)
        eigenvalue = _raised(re, im, eigenvalue)
        floor = sparse.least_share(len(re) - 1, noise or float(np.finfo(scale.dtype).eps))
        phase, weight, count = _returns(re, im, eigenvalue, scale, floor)
        return phase, weight, eigenvalue * scale, count


def redo(b: Array, found: Sequence[Array], ill: Array, noise: float) -> None:
    """Redo pixels whose returns don't reproduce their moments, with more digits and more care.

    Parameters
    ----------
    b : array, shape (m + 1, P)
        Moments.
    found : sequence of array
        Phase, weight, uniform, count of all pixels; written to.
    ill : integer array
        The pixels.
    noise : float
        Precision of the data.
    """
    if not ill.size:
        return
    enough = sparse.largest_residual(len(b) - 1, noise)
    with np.errstate(all="ignore"):
        wide = b[:, ill].astype(np.complex128)
        better: tuple[Array, ...] = first_returns(wide, noise=noise)[:3]
        better = polish(wide, *better, tolerance=enough / 4)
        for coarser in (1e2, 1e4, 1e6):
            _take_if_better(wide, better, coarser * noise, enough)
        phase, weight, uniform = polish(wide, *better, tolerance=enough / 4)
        weight, uniform = weight.astype(found[1].dtype), uniform.astype(found[2].dtype)
        # what is less than the least number of that precision isn't a return
        phase = in_turn(np.where(weight > 0, phase, np.nan).astype(found[0].dtype))
    ascending = np.argsort(phase, axis=0)
    phase, weight = (np.take_along_axis(part, ascending, axis=0) for part in (phase, weight))
    for plane, new in zip(found, (phase, weight, uniform, (weight > 0).sum(axis=0)), strict=True):
        plane[..., ill] = new


def _take_if_better(b: Array, found: tuple[Array, ...], noise: float, tolerance: float) -> None:
    """Solve again, taking returns for one that are one to the precision `noise`; keep what fits."""
    error = size(residual(b, *found), b)
    at = np.flatnonzero(error > tolerance)
    if not at.size:
        return
    tried = by_blocks(lambda part: first_returns(part, noise=noise)[:3], b[:, at])
    fits = size(residual(b[:, at], *tried), b[:, at]) < error[at]
    for part, new in zip(found, tried, strict=True):
        part[..., at[fits]] = new[..., fits]


def _returns(
    re: list[Array], im: list[Array], uniform: Array, scale: Array, floor: float
) -> tuple[Array, Array, Array]:
    """Find the returns of moments of which the largest is 1, with a singular B - uniform I.

    Prediction errors and weights below `floor`, relative to the brightness, are rounding. Weights
    are multiplied with `scale`.
    """
    xp, m = namespace(scale), len(re) - 1
    order = (0,) * m
    total = re[0] - uniform  # "using b_0 - lambda_m in place of b_0" (Sec. 5.1)
    lit = total > 0
    inverse = xp.where(lit, 1 / xp.where(lit, total, 1), 0)
    re = [xp.ones_like(total), *(part * inverse for part in re[1:])]
    im = [part * inverse for part in im]
    ar, ai = bank(total, order, 1), bank(total, order, 1)
    gr, gi = bank(total, order, 0), bank(total, order, 0)
    inverse_errors = bank(total, order, 0)
    # c of Theorem 2 is a; smaller blocks are singular where there are fewer returns than harmonics
    degree: Array = toeplitz.singular(
        order, re, im, xp.full_like(total, floor), ar, ai, gr, gi, inverse_errors
    )
    phases = [xp.full_like(total, np.nan)] * m
    weights = [xp.zeros_like(total)] * m
    for count in range(1, m + 1):
        at = lit & (degree == count)
        if not some(at):
            continue
        light, unit = _of(at, [total, scale])
        steps = (_of(at, planes) for planes in (ar, ai, gr, gi, inverse_errors))
        for k, (phase, share) in enumerate(_roots(count, *steps)):
            weight = share * light * unit
            used = (share > floor) & (weight > 0)
            phases[k] = _put(phases[k], at, xp.where(used, phase, np.nan))
            weights[k] = _put(weights[k], at, xp.where(used, weight, 0))
    phase, weight = xp.stack(phases), xp.stack(weights)
    ascending = xp.argsort(phase, axis=0)  # NaN comes last
    return (
        xp.take_along_axis(phase, ascending, axis=0),
        xp.take_along_axis(weight, ascending, axis=0),
        (weight > 0).sum(axis=0).astype(np.int32),
    )


def _raised(re: list[Array], im: list[Array], eigenvalue: Array) -> Array:
    """Return an eigenvalue at which Levinson's recursion finds B singular, despite its rounding.

    With (B - mu I) a = E e_0, mu + E / |a|^2 is a Rayleigh quotient, which is never too low. Where
    the eigenvalue is, blocks smaller than B that are singular as well might not seem so.
    """
    order = (0,) * (len(re) - 1)
    total = re[0] - eigenvalue
    inverse = 1 / total
    ar, ai = bank(total, order, 1), bank(total, order, 1)
    gr, gi = bank(total, order, 0), bank(total, order, 0)
    unit = [part * inverse for part in re], [part * inverse for part in im]
    unit[0][0] = 1 + 0 * total
    error = toeplitz.levinson(order, *unit, ar, ai, gr, gi)
    norm = 1 + sum(ar[k] * ar[k] + ai[k] * ai[k] for k in range(1, len(re)))
    quotient = eigenvalue + total * error / norm
    return namespace(total).where(total > 0, quotient, eigenvalue)


def _roots(
    count: int,
    ar: list[Array],
    ai: list[Array],
    gr: list[Array],
    gi: list[Array],
    inverse: list[Array],
) -> Iterator[tuple[Array, Array]]:
    """Yield phase and share of so many returns, of pixels that have as many."""
    order = (0,) * count
    turns = circle.half_turns(count, inverse[0].dtype)
    wr, wi = bank(inverse[0], order, 0), bank(inverse[0], order, 0)
    circle.circle_roots(order, turns, _STEPS, ar[: count + 1], ai[: count + 1], wr, wi)
    for x, y in zip(wr, wi, strict=True):
        # the weights add up to the light of the returns at exact roots only
        _, x, y = circle.weigh(order, gr, gi, inverse, x, y)
        share, x, y = circle.weigh(order, gr, gi, inverse, x, y)
        yield circle.phase_of(*circle.doubled(x, y)), share


def _of(mask: Array, planes: list[Array]) -> list[Array]:
    """Return the pixels of a mask; in NumPy alone, where their number may depend on values."""
    return [plane[mask] for plane in planes] if isinstance(mask, np.ndarray) else planes


def _put(plane: Array, mask: Array, values: Array) -> Array:
    """Return a plane with the pixels of a mask as `_of` gave them, changed."""
    if not isinstance(mask, np.ndarray):
        return namespace(plane).where(mask, values, plane)
    plane = plane.copy()
    plane[mask] = values
    return plane
