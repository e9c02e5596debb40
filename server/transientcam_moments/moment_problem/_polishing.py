"""Returns that don't reproduce their moments to the last digits: their weights, then Newton steps.

Returns that nearly coincide amplify rounding: their nodes are known to eps over their distance, and
their weights to that over the distance again. Moments are linear in the weights: least squares
finds those that belong to the nodes as they are. The moments as a function of phases, weights and
uniform part are smooth, so that one or two Newton steps bring what is missing. Few pixels need it.
"""

import numpy as np

from transientcam_moments.arrays import Array, to_complex

_STEPS = 6
_LEAST_SHARE = 0.1  # of Newton's step; where less is needed, the linear system has no information


def residual(b: Array, phase: Array, weight: Array, uniform: Array) -> Array:
    """Return what returns and uniform part leave of moments, shape (m + 1, P), NumPy arrays."""
    turn = np.where(weight > 0, phase, 0)
    node = to_complex(np.cos(turn), np.sin(turn))
    power = weight
    left = np.array(b)
    left[0] = b[0].real - (weight.sum(axis=0) + uniform)
    for j in range(1, b.shape[0]):
        power = power * node
        left[j] = b[j] - power.sum(axis=0)
    return left


def size(left: Array, b: Array) -> Array:
    """Return the largest component of a residual relative to the largest moment, shape (P)."""
    with np.errstate(all="ignore"):
        scale = np.abs(b).max(axis=0)
        return np.where(scale > 0, np.abs(left).max(axis=0) / scale, 0)


def polish(
    b: Array, phase: Array, weight: Array, uniform: Array, *, tolerance: float
) -> tuple[Array, ...]:
    """Improve returns (m, P) and uniform part (P) until they reproduce b (m + 1, P).

    `tolerance` is the relative residual that is good enough.

    Returns
    -------
    phase, weight, uniform : array
        A step is kept where it reduces the residual and leaves all weights positive.
    """
    phase, weight, uniform = phase.copy(), weight.copy(), uniform.copy()
    left = residual(b, phase, weight, uniform)
    error = size(left, b)
    at = np.flatnonzero(error > tolerance)
    if at.size:
        changed = weight[:, at] + _weights(left[:, at], phase[:, at], weight[:, at])
        left_now = residual(b[:, at], phase[:, at], changed, uniform[at])
        error_now = size(left_now, b[:, at])
        better = (error_now < error[at]) & ((changed > 0) | (weight[:, at] <= 0)).all(axis=0)
        to = at[better]
        weight[:, to], left[:, to], error[to] = (
            part[..., better] for part in (changed, left_now, error_now)
        )
    share = np.ones_like(uniform)
    for _ in range(_STEPS):
        at = np.flatnonzero((error > tolerance) & (share > _LEAST_SHARE))
        if not at.size:
            break
        tried = _tried(left[:, at], phase[:, at], weight[:, at], uniform[at], share[at])
        left_now = residual(b[:, at], *tried)
        error_now = size(left_now, b[:, at])
        used = weight[:, at] > 0
        better = (error_now < error[at]) & ((tried[1] > 0) | ~used).all(axis=0)
        share[at] = np.where(better, np.minimum(4 * share[at], 1), share[at] / 4)
        to = at[better]
        phase[:, to], weight[:, to], uniform[to] = (part[..., better] for part in tried)
        left[:, to], error[to] = left_now[:, better], error_now[better]
    return phase, weight, uniform


def _tried(
    left: Array, phase: Array, weight: Array, uniform: Array, share: Array
) -> tuple[Array, Array, Array]:
    """Go a share of Newton's step."""
    turn, gain, lift = (share * part for part in _step(left, phase, weight))
    used = weight > 0
    return (
        np.where(used, phase + turn, np.nan) % (2 * np.pi),
        np.where(used, weight + gain, 0),
        uniform + lift,
    )


def _weights(left: Array, phase: Array, weight: Array) -> Array:
    """Return the changes of weights (m, P) that leave least of the residual, by least squares."""
    used = weight > 0
    wave = _waves(phase, used)
    system = np.concatenate([wave.real, wave[1:].imag]).transpose(2, 0, 1)
    right = np.concatenate([left.real, left[1:].imag]).T[..., None]
    return np.where(used, _solved(system, right, ~used.T), 0)


def _waves(phase: Array, used: Array) -> Array:
    """Return exp(i j phi_k), shape (m + 1, m, P); 0 for unused returns."""
    j = np.arange(len(phase) + 1)[:, None, None]
    return np.where(used, np.exp(1j * j * np.where(used, phase, 0)), 0)


def _solved(system: Array, right: Array, unused: Array) -> Array:
    """Solve systems (P, rows, n) by least squares; some of the unknowns (P, n) are unused."""
    count = system.shape[2]
    q, r = np.linalg.qr(system)
    with np.errstate(all="ignore"):
        r = r + unused[:, :, None] * np.eye(count)
        flat = np.abs(r.diagonal(axis1=1, axis2=2)).min(axis=1) == 0
        r[flat] = np.eye(count)  # nothing can be solved here; the result will not be kept
        solution: Array = np.linalg.solve(r, q.transpose(0, 2, 1) @ right)[..., 0].T
    return solution


def _step(left: Array, phase: Array, weight: Array) -> tuple[Array, Array, Array]:
    """Solve the linearised system for the changes of phase, weight and uniform part.

    The derivatives of b_j are exp(i j phi_k) by w_k and i j w_k exp(i j phi_k) by phi_k, and those
    of b_0 are 1 by the uniform part. Phases enter as w_k dphi_k, so that faint returns count.
    """
    m, pixels = weight.shape
    used = weight > 0
    j = np.arange(m + 1)[:, None, None]
    wave = _waves(phase, used)
    columns = np.concatenate([wave, 1j * j * wave, np.zeros((m + 1, 1, pixels))], axis=1)
    columns[0, -1] = 1
    system = np.concatenate([columns.real, columns[1:].imag]).transpose(2, 0, 1)
    right = np.concatenate([left.real, left[1:].imag]).T[..., None]
    unused = np.concatenate([~used, ~used, np.zeros((1, pixels), bool)]).T
    with np.errstate(all="ignore"):
        change = _solved(system, right, unused)
        turn = np.where(used, change[m : 2 * m] / np.where(used, weight, 1), 0)
    return turn, change[:m], change[2 * m]
