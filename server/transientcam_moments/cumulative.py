"""The cumulative density in closed form, and by quadrature where the closed form is ill."""

from typing import Any

import numpy as np

from transientcam_moments._arrays import Array, flat_planes, namespace, phases, squared
from transientcam_moments.levinson import Coefficients
from transientcam_moments.roots import disc_roots

_BLOCK_VALUES = 1 << 16
# sum |C_l| / b_0 is what the closed form multiplies rounding with
_AMPLIFICATION = 1e4
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
    a = flat_planes(coefficients.polynomial)
    error = coefficients.error.reshape(-1)
    phase = phases(phase_rad, like=a)
    xp = namespace(a)
    if xp is not np:
        out, _ = _cumulative(a, error, phase)
        return out.reshape((phase.shape[0], *coefficients.error.shape))
    wide, exact = a.astype(np.complex128), error.astype(np.float64)
    out = np.empty((phase.shape[0], wide.shape[1]), error.dtype)
    pixels = max(128, _BLOCK_VALUES // max(1, phase.shape[0]))
    for start in range(0, wide.shape[1], pixels):
        part = slice(start, start + pixels)
        out[:, part] = _with_fallback(wide[:, part], exact[part], phase)
    return out.reshape((phase.shape[0], *coefficients.error.shape))


def _with_fallback(a: Array, error: Array, phase: Array) -> Array:
    out, amplification = _cumulative(a, error, phase)
    ill = np.flatnonzero(~(amplification <= _AMPLIFICATION) & np.isfinite(error) & (error > 0))
    if ill.size:
        out[:, ill] = _quadrature(a[:, ill], error[ill], phase)
    return out


def _cumulative(a: Array, error: Array, phase: Array) -> tuple[Array, Array]:
    """Planar statement of the closed form; also returns sum |C_l| / b_0."""
    xp = namespace(a)
    with np.errstate(all="ignore"):
        poles = disc_roots(list(a[1:]))
        shares = _shares(poles)
        # partial fractions give C_0 .. C_{m-1} with sum C_l = b_0
        b0 = sum(share.real for share in shares)
        size = sum(xp.sqrt(squared(share)) for share in shares)
        turn = phase[:, None]
        whole = turn * xp.ones_like(error)
        total = whole * b0
        rotation = xp.cos(turn) - 1j * xp.sin(turn)
        rotation = rotation.astype(a.dtype)
        for pole, share in zip(poles, shares, strict=True):
            factor = (1 - pole * rotation) / (1 - pole)  # in the right half plane times its twin
            angle = xp.arctan2((1 - pole * rotation).imag, (1 - pole * rotation).real)
            angle = angle - xp.arctan2((1 - pole).imag, (1 - pole).real)
            total = total + 2 * (share.real * angle + share.imag * xp.log(squared(factor)) / 2)
        return (total * (error / (2 * np.pi))).astype(error.dtype), size / b0


def _shares(poles: list[Array]) -> list[Array]:
    """Return C_l / E = p_l^{m-1} / prod_{j != l} (p_l - p_j) / prod_j (1 - conj(p_j) p_l)."""
    shares = []
    for index, pole in enumerate(poles):
        below = 1 - pole.conj() * pole
        share = pole**0
        for other_index, other in enumerate(poles):
            if other_index != index:
                below = below * (1 - other.conj() * pole) * (pole - other)
                share = share * pole
        shares.append(share / below)
    return shares


def _quadrature(a: Array, error: Array, phase: Array) -> Array:
    """Integrate by Gauss-Legendre rules on intervals that halve towards the angle of each pole."""
    with np.errstate(all="ignore"):
        angles = np.angle(np.stack(disc_roots(list(a[1:])))) % (2 * np.pi)
    steps = np.pi * 0.5 ** np.arange(_LEVELS)
    offsets = np.concatenate([-steps, [0.0], steps[::-1]])
    marks = (angles[:, None] + offsets[:, None]).reshape(-1, a.shape[1]) % (2 * np.pi)
    turns = np.floor(phase / (2 * np.pi))
    rest = np.asarray(phase - 2 * np.pi * turns, dtype=float)
    wanted = np.broadcast_to(rest[:, None], (rest.size, a.shape[1]))
    ends = np.zeros((1, a.shape[1]))
    knots = np.sort(np.concatenate([ends, marks, wanted, ends + 2 * np.pi]), axis=0)
    running = np.concatenate([ends, np.cumsum(_panels(a, error, knots), axis=0)])
    out = np.empty(wanted.shape)
    for pixel in range(a.shape[1]):  # few pixels come here
        at = np.searchsorted(knots[:, pixel], rest)
        out[:, pixel] = running[at, pixel] + turns * running[-1, pixel]
    return out


def _panels(a: Array, error: Array, knots: Array) -> Array:
    """Integrate the density between neighbouring knots (K, P) to (K - 1, P)."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    centre, half = (knots[1:] + knots[:-1]) / 2, (knots[1:] - knots[:-1]) / 2
    total: Any = 0.0
    for node, weight in zip(nodes, weights, strict=True):
        z = np.exp(-1j * (centre + half * node))
        value = np.broadcast_to(a[-1], z.shape)
        for plane in a[-2::-1]:
            value = value * z + plane
        total = total + weight / squared(value)
    return total * half * error / (2 * np.pi)
