"""First-order noise of the maximum entropy density and of its peaks."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from transientcam_moments._arrays import Array, in_range, moment_planes, phases
from transientcam_moments.biasing import EPSILON, bias, estimate_zeroth
from transientcam_moments.levinson import Coefficients, levinson
from transientcam_moments.maximum_entropy import density
from transientcam_moments.noise.moments import MomentNoise
from transientcam_moments.peaks import PEAK_THRESHOLD, peaks

CLEAR = 5.0
"""Standard deviations that eigenvalues must keep from each other and from the limit of biasing."""


FAR, BENT = 5.0, 1.2
"""How far moments are moved to see whether what they determine follows, in standard deviations of
theirs, and how far it may be from where the differential sees it, in those of its own."""


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


class PeakNoise(NamedTuple):
    """The first peak of a density, and how much noise moves it.

    Attributes
    ----------
    phase_rad : array, shape (...)
        As `peaks` finds it; NaN without any.
    phase_std_rad : array, shape (...)
        Its standard deviation; NaN without any.
    holds : boolean array, shape (...)
        Where first order holds.
    """

    phase_rad: Array
    phase_std_rad: Array
    holds: Array


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
        In double precision.

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
        holds = system.holds & (std > 0)
        for step in _steps(system.variance):
            moved = density(_coefficients(system.measured + step, epsilon, zeroth), phase)
            expected = [(part.conj() * step).real.sum(axis=0) for part in slope]
            holds &= abs(moved - height - np.reshape(expected, height.shape)) < BENT * std
    shape = (len(phase), *system.trailing)
    return DensityNoise(height.reshape(shape), std.reshape(shape), holds.reshape(shape))


def peak_noise(
    b: Array,
    noise: MomentNoise,
    *,
    threshold: float = PEAK_THRESHOLD,
    epsilon: float = EPSILON,
    zeroth: str = "low-frequency",
) -> PeakNoise:
    """Propagate the noise of moments to the first peak of the density, the range of Sec. 5.3.

    Parameters
    ----------
    b, noise, epsilon, zeroth
        As for `density_noise`.
    threshold : float
        As for `peaks`, 0 to 1.

    Returns
    -------
    PeakNoise
        In double precision.

    Notes
    -----
    At a maximum Re(Q' / Q) = 0 with Q = q* s; differentiating that gives dphi. Beside what
    `density_noise` asks for, the peak has to move as the differential says when any moment is
    off by `FAR` standard deviations, to `BENT` of its own: one might come out of a shoulder.
    Nor may an earlier one reach the threshold, this one fall below it, or cross the ends of the
    turn.
    """
    in_range("threshold", threshold, 0.0, 1.0, "0 to 1")
    system = _System(b, noise, epsilon=epsilon, zeroth=zeroth)
    found = peaks(levinson(system.b), threshold=threshold)
    first_rad = found.first_rad
    with np.errstate(all="ignore"):
        gradient, curvature = system.peak(np.nan_to_num(first_rad))
        gradient = system.through_bias(gradient) / -curvature
        std = np.where(
            np.isnan(first_rad), np.nan, MomentNoise(system.variance).deviation(gradient)
        )
        holds = system.holds & (std > 0) & _decided(system, first_rad, std, threshold)
        for step in _steps(system.variance):
            coefficients = _coefficients(system.measured + step, epsilon, zeroth)
            moved = peaks(coefficients, threshold=threshold).first_rad
            by = np.remainder(moved - first_rad + np.pi, 2 * np.pi) - np.pi
            expected = (gradient.conj() * step).real.sum(axis=0)
            holds &= abs(by - expected) < BENT * std
    return PeakNoise(
        first_rad.reshape(system.trailing),
        std.reshape(system.trailing),
        holds.reshape(system.trailing),
    )


def _decided(system: "_System", first_rad: Array, std: Array, threshold: float) -> Array:
    """Whether noise cannot make another peak the first one above the threshold."""
    found = peaks(levinson(system.b), threshold=0.0)
    first = np.nan_to_num(first_rad)
    decided = (first > CLEAR * std) & (2 * np.pi - first > CLEAR * std)
    strongest = np.nan_to_num(found.strongest_rad)
    highest, of_highest = system.density(strongest)
    for phase in found.phase_rad:
        where = np.nan_to_num(phase)
        height, slope = system.density(where)
        sways = _noise_of(system, slope - of_highest)
        clear = abs(np.log(height / highest / threshold)) > CLEAR * sways
        decided &= np.isnan(phase) | (where > first) | (where == strongest) | clear
    return decided


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


def _noise_of(system: "_System", gradient: Array) -> Array:
    """Return the standard deviation of a quantity with a gradient in the biased moments."""
    return MomentNoise(system.variance).deviation(system.through_bias(gradient))


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
        self.measured = self.b.copy()
        eigenvalues, vectors = np.linalg.eigh(_toeplitz(self.b))
        self._vector = vectors[:, :, 0].T  # (m + 1, P)
        smallest = eigenvalues[:, 0]
        b0 = self.b[0].real
        self.biased = (smallest < epsilon * b0) | (zeroth == "estimated")
        self.b[0] = np.where(self.biased, (b0 - smallest) / (1 - epsilon), b0)
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
        return holds

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

    def peak(self, phase: Array) -> tuple[Array, Array]:
        """Gradient and derivative of half the slope of log h, -Re(Q' / Q)."""
        order = np.arange(len(self.b))[:, None]
        steering = np.exp(1j * order * phase)
        value, first, second = (
            (self.q.conj() * (1j * order) ** power * steering).sum(axis=0) for power in range(3)
        )
        gradient = _form(self.q, self._solve(1j * order * steering), 1 / value)
        gradient = gradient - _form(self.q, self._solve(steering), first / value**2)
        return gradient, -(second / value - (first / value) ** 2).real

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
