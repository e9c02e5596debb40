"""First-order noise of the maximum entropy density."""

import numpy as np

from transientcam_moments.arrays import Array, in_range, moment_planes, phases, squared
from transientcam_moments.moment_problem import EPSILON
from transientcam_moments.noise._moments import MomentNoise

_BLOCK_VALUES = 1 << 17


def density_std(
    b: Array,
    noise: MomentNoise,
    phase_rad: Array,
    *,
    epsilon: float = EPSILON,
    zeroth: str = "low-frequency",
) -> Array:
    """Return the standard deviation of the maximum entropy density, biasing included.

    Parameters
    ----------
    b : array, shape (m + 1, ...)
        Moments before biasing.
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
    array, shape (T, ...), float32
        In the unit of b_0 per radian; NaN where a moment is not finite or there is no light.
        Multiply by 2 pi f for a density per second.

    Raises
    ------
    ShapeError
        When `b` is not 2 to 33 planes of numbers.
    ParameterError
        For an epsilon outside of 0 <= epsilon < 1.

    Notes
    -----
    To first order. With q = B^-1 e_0 Eq. (2) is h = q_0 / (2 pi |q* s|^2), s = (exp(i j phi))_j,
    and dq = -B^-1 dB q. Where b_0 is raised, it is (b_0 - lambda) / (1 - epsilon), and the smallest
    eigenvalue moves by c* dB c with its eigenvector c.
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

    def std(self, steering: Array) -> Array:
        """Return the standard deviation (T, P) of the density at s(phi) (m + 1, T), complex64.

        With Q = q* s: dq_0 = -q* dB q, dQ = -q* dB (B^-1 s), dlog h = dq_0 / q_0 - 2 Re(dQ / Q).
        The Toeplitz forms are linear in s: one matrix product for all phases and pixels.
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
