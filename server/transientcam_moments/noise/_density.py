"""First-order noise of the maximum entropy density."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from transientcam_moments.arrays import Array, in_range, moment_planes, phases, squared, summary
from transientcam_moments.moment_problem import (
    EPSILON,
    Coefficients,
    bias,
    density,
    estimate_zeroth,
    levinson,
)
from transientcam_moments.noise._moments import MomentNoise

CLEAR = 5.0
"""Standard deviations that eigenvalues must keep from each other and from the limit of biasing."""
FAR, BENT = 5.0, 1.2
"""How far moments are moved to see whether what they determine follows, in standard deviations of
theirs, and how far it may be from where the differential sees it, in those of its own."""
_BLOCK_VALUES = 1 << 17


class DensityNoise(NamedTuple):
    """Standard deviation of a density at given phases.

    Attributes
    ----------
    density : array, shape (T, ...)
        The density itself, in the unit of b_0 per radian.
    std : array, shape (T, ...)
        Its standard deviation, in the same unit.
    holds : boolean array, shape (T, ...)
        Where first order holds.
    """

    density: Array
    std: Array
    holds: Array

    def __repr__(self) -> str:
        """State the shapes and spans of its arrays."""
        return summary(self)


def density_noise(
    b: Array,
    noise: MomentNoise,
    phase_rad: Array,
    *,
    epsilon: float = EPSILON,
    zeroth: str = "low-frequency",
) -> DensityNoise:
    """Propagate the noise of moments to the maximum entropy density, biasing included.

    Parameters
    ----------
    b : array, shape (m + 1, ...)
        Moments before biasing, without noise if those are known, else the measured ones.
    noise : MomentNoise
        Of shape (m + 1, ...).
    phase_rad : array, shape (T,)
        Phases in radian.
    epsilon : float
        Least uniform part relative to b_0, as for `bias`, which keeps the harmonics.
    zeroth : {"low-frequency", "on-off", "estimated"}
        With "estimated" b_0 is what `estimate_zeroth` makes of the others.

    Returns
    -------
    DensityNoise
        In double precision; NaN where a moment is not finite or there is no light.

    Notes
    -----
    With q = B^-1 e_0 Eq. (2) is h = q_0 / (2 pi |q* s|^2), s = (exp(i j phi))_j, and
    dq = -B^-1 dB q. Where b_0 is raised, it is (b_0 - lambda) / (1 - epsilon), and the smallest
    eigenvalue moves by c* dB c with its eigenvector c.

    First order fails where an eigenvalue is no larger than what noise does to it, where the two
    smallest ones come as close, so that their eigenvectors are noise (fewer than m returns), and
    where noise decides whether a pixel is biased. A density beside a sharp peak follows a moment
    only a little way before it bends: it has to do so for `FAR` standard deviations of any.
    """
    system = _System(b, noise, epsilon=epsilon, zeroth=zeroth)
    phase = np.asarray(phases(phase_rad, like=system.b), dtype=float)
    each = [system.density(np.full(system.pixels, at)) for at in phase]
    height = np.array([height for height, _ in each]).reshape((len(phase), system.pixels))
    slope = [system.through_bias(slope) * height[k] for k, (_, slope) in enumerate(each)]
    with np.errstate(all="ignore"):
        std = np.array([MomentNoise(system.variance).deviation(part) for part in slope])
        std = std.reshape(height.shape)
        std[:, ~system.lit] = height[:, ~system.lit] = np.nan
        holds = system.holds & (std > 0)
        for step in _steps(system.variance):
            moved = density(_coefficients(system.measured + step, epsilon, zeroth), phase)
            expected = [(part.conj() * step).real.sum(axis=0) for part in slope]
            holds &= abs(moved - height - np.reshape(expected, height.shape)) < BENT * std
    shape = (len(phase), *system.trailing)
    return DensityNoise(height.reshape(shape), std.reshape(shape), holds.reshape(shape))


def density_std(
    b: Array,
    noise: MomentNoise,
    phase_rad: Array,
    *,
    epsilon: float = EPSILON,
    zeroth: str = "low-frequency",
) -> Array:
    """Return the standard deviation of the maximum entropy density alone, for whole frames.

    Parameters
    ----------
    b, noise, phase_rad, epsilon, zeroth
        As for `density_noise`.

    Returns
    -------
    array, shape (T, ...), float32
        In the unit of b_0 per radian; NaN where a moment is not finite or there is no light.
        Multiply by 2 pi f for a density per second.

    Raises
    ------
    ShapeError, ParameterError
        As `density_noise` does.

    Notes
    -----
    `density_noise` says where first order holds, which takes most of its time.
    """
    planes, trailing = moment_planes(b)
    variance = np.asarray(noise.variance).reshape(planes.shape)
    phase = np.asarray(phases(phase_rad, like=planes), dtype=float)
    steering = np.exp(1j * np.arange(len(planes))[:, None] * phase).astype(np.complex64)
    out = np.empty((phase.size, planes.shape[1]), np.float32)
    pixels = max(64, _BLOCK_VALUES // max(1, phase.size))
    for start in range(0, planes.shape[1], pixels):
        part = slice(start, start + pixels)
        of_part = MomentNoise(variance[:, part])
        system = _System(planes[:, part], of_part, epsilon=epsilon, zeroth=zeroth)
        out[:, part] = system.std(steering)
    return out.reshape((phase.size, *trailing))


def _steps(variance: Array) -> Iterator[Array]:
    """Yield steps of `FAR` standard deviations in either direction of every real moment."""
    for j, plane in enumerate(variance):
        for direction in (FAR, -FAR, 1j * FAR, -1j * FAR)[: 2 if j == 0 else 4]:
            step = np.zeros(variance.shape, dtype=np.complex128)
            step[j] = direction * np.sqrt(plane)
            yield step


def _coefficients(b: Array, epsilon: float, zeroth: str) -> Coefficients:
    """Return the density that moments lead to."""
    if zeroth == "estimated":
        b = estimate_zeroth(b, epsilon)
    return levinson(bias(b, epsilon).moments)


class _System:
    """The Toeplitz systems of all pixels, pixels first, and how they answer to noise."""

    def __init__(self, b: Array, noise: MomentNoise, *, epsilon: float, zeroth: str) -> None:
        in_range("epsilon", epsilon, 0.0, float(np.nextafter(1.0, 0.0)), "0 <= epsilon < 1")
        planes, self.trailing = moment_planes(b)
        self.b = np.asarray(planes).astype(np.complex128)
        self.pixels = self.b.shape[1]
        self.epsilon = epsilon
        self.variance = np.asarray(noise.variance, dtype=float).reshape(self.b.shape)
        if zeroth == "estimated":
            self.b[0] = 0
        finite = np.isfinite(self.b).all(axis=0) & np.isfinite(self.variance).all(axis=0)
        self.b[:, ~finite] = 0
        self.measured = self.b.copy()
        eigenvalues, vectors = np.linalg.eigh(_toeplitz(self.b))
        self._vector = vectors[:, :, 0].T  # (m + 1, P)
        smallest = eigenvalues[:, 0]
        b0 = self.b[0].real
        self.biased = (smallest < epsilon * b0) | (zeroth == "estimated")
        self.b[0] = np.where(self.biased, (b0 - smallest) / (1 - epsilon), b0)
        self.lit = finite & (self.b[0].real > 0)
        self.b[:, ~self.lit] = np.eye(len(self.b), 1)  # has an inverse, and is not used
        self.inverse = np.linalg.inv(_toeplitz(self.b))
        self.q = self.inverse[:, :, 0].T
        self.holds = self._holds(b0, eigenvalues, zeroth)

    def _holds(self, b0: Array, eigenvalues: Array, zeroth: str) -> Array:
        smallest = eigenvalues[:, 0]
        noise = MomentNoise(self.variance)
        # what noise can do to an eigenvector: the norm of its matrix, roughly
        size = np.sqrt(self.variance[0] + 2 * self.variance[1:].sum(axis=0))
        moved = noise.deviation(_form(self._vector, self._vector, 1.0))
        gap = eigenvalues[:, 1] - smallest
        holds = np.where(self.biased, gap > CLEAR * size, smallest > CLEAR * size)
        if zeroth != "estimated":
            holds &= abs(smallest - self.epsilon * b0) > CLEAR * moved
        return np.asarray(holds & self.lit)

    def through_bias(self, gradient: Array) -> Array:
        """Turn a gradient in the biased moments into one in the measured ones."""
        raised = _form(self._vector, self._vector, 1.0)  # of the smallest eigenvalue
        raised[0] = 0  # (b_0 - lambda) does not depend on b_0
        through = gradient - gradient[0].real * raised / (1 - self.epsilon)
        through[0] = 0
        return np.where(self.biased, through, gradient)

    def density(self, phase: Array) -> tuple[Array, Array]:
        """Height at one phase a pixel, and gradient of its logarithm."""
        steering = np.exp(1j * np.arange(len(self.b))[:, None] * phase)
        value = (self.q.conj() * steering).sum(axis=0)
        height = self.q[0].real / (2 * np.pi * np.abs(value) ** 2)
        # dq_0 = -q* dB q, dQ = -q* dB (B^-1 s), dlog h = dq_0 / q_0 - 2 Re(dQ / Q)
        gradient = _form(self.q, self.q, -1 / self.q[0].real)
        return height, gradient + _form(self.q, self._solve(steering), 2 / value)

    def std(self, steering: Array) -> Array:
        """Return the standard deviation (T, P) of the density at s(phi) (m + 1, T), complex64.

        The gradient of log h is that of `density`. Its Toeplitz forms are linear in s, which
        leaves one matrix product for all phases and pixels.
        """
        n, q = len(self.b), self.q
        forms = np.empty((self.pixels, 2, n, n), np.complex64)
        for lag in range(n):
            forms[:, 0, lag] = np.einsum("ip,pik->pk", q[lag:].conj(), self.inverse[:, : n - lag])
            forms[:, 1, lag] = np.einsum("ip,pik->pk", q[: n - lag].conj(), self.inverse[:, lag:])
        products = (forms.reshape((-1, n)) @ steering).reshape((self.pixels, 2, n, -1))
        value = q.T.conj().astype(np.complex64) @ steering
        constant = _form(q, q, -1 / q[0].real).astype(np.complex64)[..., None]
        raised = _form(self._vector, self._vector, 1 / (1 - self.epsilon))
        raised = np.where(self.biased, raised, 0).astype(np.complex64)[..., None]
        variance = self.variance.astype(np.float32)[..., None]
        with np.errstate(all="ignore"):
            factor = 2 / value
            of_b0 = (factor * products[:, 0, 0]).real + constant[0].real
            total = np.where(self.biased[:, None], 0, of_b0**2 * variance[0])
            for lag in range(1, n):
                gradient = (factor * products[:, 0, lag]).conj() + factor * products[:, 1, lag]
                gradient += constant[lag] - of_b0 * raised[lag]
                total += squared(gradient) * variance[lag]
            height = (q[0].real / (2 * np.pi)).astype(np.float32)[:, None] / squared(value)
            return np.where(self.lit, (height * np.sqrt(total)).T, np.nan)

    def _solve(self, right: Array) -> Array:
        return np.einsum("pjk,kp->jp", self.inverse, right)


def _toeplitz(b: Array) -> Array:
    """Return B[j, k] = b_{j-k} as (P, m + 1, m + 1)."""
    order = np.arange(len(b))
    lag = order[:, None] - order[None]
    matrix = np.where(lag[..., None] >= 0, b[abs(lag)], b[abs(lag)].conj())
    return np.moveaxis(matrix, -1, 0)


def _form(u: Array, v: Array, factor: Array | float | complex) -> Array:
    """Gradient (m + 1, P) of Re(factor u* dB v) in the moments that make up the Toeplitz dB."""
    m = len(u) - 1
    gradient = np.empty(np.broadcast(u, v).shape, dtype=np.complex128)
    for lag in range(m + 1):
        below = (u[lag:].conj() * v[: m + 1 - lag]).sum(axis=0)  # of b_lag
        above = (u[: m + 1 - lag].conj() * v[lag:]).sum(axis=0)  # of its conjugate
        gradient[lag] = np.conj(factor * below) + factor * above
    gradient[0] = gradient[0].real / 2
    return gradient
