"""Images that lost their synchronisation, found by sums of opposite images and rebuilt (Sec. 6).

Light and sensor that fall out of step spoil single images: "5-10 % of all captured images differ
significantly from other images captured with the same configuration". An image at phase step theta
is o + Re(b_j exp(-i theta)) with the same o at every frequency and phase, so that two opposite
images add up to 2 o in every pixel (Sec. 3.1). A sum unlike the others has a corrupt image in it;
the other sums less the opposite image rebuild it.

Which of the two it is follows from what a loss of synchronisation does: for a part of the exposure
it turns the phase, for all pixels alike, so that the image becomes o + Re(f b_j exp(-i theta)) with
one complex number f for the whole sensor, |f| <= 1. With X and Y the real and imaginary part of
b_j exp(-i theta), known from the three other images, f is the least squares solution of
I - o = Re(f) X - Im(f) Y. For the opposite, good image the same solution has |f| >= 1. Where all
pixels have nearly the same phase, as at the low frequency of b_0, both images may fulfil that; the
better agreement of all moments then decides. What the model does not explain is left as it is.
"""

import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from transientcam_moments.arrays import Array, summary
from transientcam_moments.errors import ShapeError
from transientcam_moments.images._calibration import calibrate
from transientcam_moments.images._four_bucket import measure
from transientcam_moments.images._pair_sums import PHASE_STEPS, PairSums, pair_sums
from transientcam_moments.moment_problem import smallest_eigenvalue

_FIRST_LOOK, _SECOND_LOOK = 400, 4096  # pixels of the sensor that are looked at
_STATIC = 8.0  # times the usual deviation, the span of good sums above which something moves
_LEAST_STATIC = 0.5  # of the pixels, or the whole picture moves
_ROUNDED = 0.3  # of the largest rounding error of a sum, its usual one
_EXPLAINED = 0.5  # of the squared deviation, which f has to explain at least
_UNEXPLAINED = 2.0  # times the usual deviation, which f may leave at most
_TOLERANCE = 0.004  # of |f| <= 1
_MARGIN = 0.03  # in smallest eigenvalues over b_0, by which the better choice has to be better
_CONTRADICTING = 0.05  # the same, by which moments after repair may be worse than they should
_NOISE = 8.0  # usual deviations of a sum over the amplitude, which they may be worse by as well
_GROUP = 4  # neighbours whose moments are averaged
_NEAREST = 5  # sums in time that rebuild an image
_UNPAIRED = {"low-frequency": 0, "on-off": 2, "estimated": 0}  # images without an opposite one

Choice = tuple[int, ...]
"""Which images of one frequency are called corrupt: one of each suspicious pair."""


class Repair(NamedTuple):
    """Images of a capture after repair, and which of them are not as they were captured.

    Attributes
    ----------
    images : array, shape (takes, N, ...)
        The images themselves where nothing was changed, else new ones of their type.
    repaired : boolean array, shape (takes, N)
        Rebuilt from the sums of the frame and the opposite image.
    filled : boolean array, shape (takes, N)
        Taken from the frame before.
    left_out : boolean array, shape (takes, N)
        Not repaired, as other takes have the same image.
    unrepaired : boolean array, shape (takes, N)
        Both images of each pair whose sum contradicts the others without any of these helping.
    """

    images: Array
    repaired: Array
    filled: Array
    left_out: Array
    unrepaired: Array

    def __repr__(self) -> str:
        """State the shapes and spans of its arrays."""
        return summary(self)


def repair(
    images: Array,
    *,
    zeroth: str = "low-frequency",
    calibration: Array | None = None,
    full_scale: float = 4095.0,
    previous: Array | None = None,
) -> Repair:
    """Find the images of each take that lost their synchronisation, and replace them.

    Parameters
    ----------
    images : array, shape (takes, N, ...)
        NumPy array of real numbers, the images of a take in the order of `measure`.
    zeroth : {"low-frequency", "on-off", "estimated"}
        How b_0 was measured. Images without modulation have no synchronisation to lose.
    calibration : array, shape (m + 1,) or (m + 1, ...), optional
        Gains. Without them pairs that their sums alone do not decide are not repaired.
    full_scale : float
        Largest value of an image. Pixels that reach it decide nothing.
    previous : array, shape (takes, N, ...), optional
        The frame before, from which images are filled in that cannot be rebuilt (Sec. 6).

    Returns
    -------
    Repair

    Raises
    ------
    ShapeError
        When `previous` has another shape.

    Notes
    -----
    A corrupt image that another take has intact is left out, which costs less noise than rebuilding
    it. Nothing is found with fewer than three sums (m = 1, unless b_0 is measured at a low
    frequency), with fewer than 64 pixels with light, or where the phase turned by so little that
    the sum is less than half as much off again as its noise.
    """
    takes, count = images.shape[:2]
    first = _UNPAIRED[zeroth]
    corrupt = np.zeros((takes, count), dtype=bool)
    unclear = np.zeros((takes, count), dtype=bool)
    usable = _usable(previous, images.shape, first, full_scale)
    for take, look in _looks(images, first, full_scale):
        gains = None if calibration is None else _at(calibration, look.pixels)
        before = None
        if previous is not None and usable[take].all():
            before = _values(previous[take], look)
        for image, is_clear in _Verdict(look, zeroth, gains, before).images():
            (corrupt if is_clear else unclear)[take, image] = True
    if not (corrupt | unclear).any():
        nothing = np.zeros((takes, count), dtype=bool)
        return Repair(images, nothing, nothing, nothing, nothing)
    left_out = (corrupt | unclear) & ~(corrupt | unclear).all(axis=0)
    repaired, unclear = corrupt & ~left_out, unclear & ~left_out
    mended = images.copy()
    for take, image in np.argwhere(repaired):
        mended[take, image] = _rebuilt(images[take], image, first, corrupt[take] | unclear[take])
    filled = unclear & usable
    if previous is not None:
        mended[filled] = previous[filled]
    return Repair(mended, repaired, filled, left_out, unclear & ~filled)


def _looks(images: Array, first: int, full_scale: float) -> Iterator[tuple[int, PairSums]]:
    """Return takes with suspicious sums: a quick look at all of them, then a thorough one."""
    for take in range(len(images)):
        for most in (_FIRST_LOOK, _SECOND_LOOK):
            look = pair_sums(images[take], first, most=most, full_scale=full_scale)
            if look is None or not look.suspicious.any():
                break
        else:
            assert look is not None  # noqa: S101  (or the loop had been left)
            yield take, look


def _usable(
    previous: Array | None, shape: tuple[int, ...], first: int, full_scale: float
) -> NDArray[np.bool_]:
    """Return which images (takes, N) of the frame before are not of a suspicious pair."""
    if previous is None:
        return np.zeros(shape[:2], dtype=bool)
    if previous.shape != shape:
        raise ShapeError("previous", f"of shape {previous.shape}", f"{shape}, as the images")
    usable = np.ones(shape[:2], dtype=bool)
    for take, look in _looks(previous, first, full_scale):
        for image in look.earlier[look.suspicious]:
            usable[take, [image, image + 2]] = False
    return usable


class _Fit(NamedTuple):
    """The factor f of one image by least squares, and how well it explains the image."""

    factor: complex
    tolerance: float
    explained: float
    unexplained: float

    @property
    def explains(self) -> bool:
        """Whether light at another phase, and nothing else, makes the sum deviate."""
        return self.explained >= _EXPLAINED and self.unexplained <= _UNEXPLAINED

    @property
    def is_possible(self) -> bool:
        """Whether a loss of synchronisation can have this factor."""
        return self.explains and abs(self.factor) <= 1 + self.tolerance


class _Verdict:
    """Which images of a take are corrupt, by its suspicious sums."""

    def __init__(
        self, look: PairSums, zeroth: str, gains: Array | None, before: Array | None
    ) -> None:
        self._look, self._zeroth, self._gains, self._before = look, zeroth, gains, before
        self._suspicious = look.suspicious
        good = look.sums[~self._suspicious]
        self._middle = np.median(good, axis=0) / 2
        usual = float(np.median(np.abs(np.diff(good, axis=0)))) / np.sqrt(2)
        self._usual = max(usual, _ROUNDED * look.rounding)
        self._static = np.ptp(good, axis=0) <= _STATIC * self._usual

    def images(self) -> Iterator[tuple[int, bool]]:
        """Return each corrupt image and True; both images of a pair and False where it is unclear.

        Nothing of what moves or becomes lighter or darker.
        """
        if self._static.mean() < _LEAST_STATIC:
            return
        chosen: dict[int, Choice] = {}
        several: dict[int, list[Choice]] = {}
        for each in sorted({int(pair) // 2 for pair in np.flatnonzero(self._suspicious)}):
            fits = {choice: self._fits(choice) for choice in self._choices(each)}
            possible = [c for c, found in fits.items() if all(fit.is_possible for fit in found)]
            if len(possible) == 1:
                chosen[each] = possible[0]
            elif any(all(fit.explains for fit in found) for found in fits.values()):
                several[each] = possible
        chosen |= self._best(chosen, {each: c for each, c in several.items() if c})
        if self._contradicts(tuple(itertools.chain(*chosen.values()))):
            several, chosen = several | {each: [] for each in chosen}, {}
        for each in several.keys() - chosen.keys():
            yield from ((image, False) for image in itertools.chain(*self._pairs(each)))
        yield from ((image, True) for choice in chosen.values() for image in choice)

    def _pairs(self, each: int) -> list[tuple[int, int]]:
        """Return the images of the suspicious pairs of one frequency."""
        pairs = (pair for pair in (2 * each, 2 * each + 1) if self._suspicious[pair])
        return [(int(self._look.earlier[p]), int(self._look.earlier[p]) + 2) for p in pairs]

    def _choices(self, each: int) -> list[Choice]:
        return list(itertools.product(*self._pairs(each)))

    def _fits(self, choice: Choice) -> list[_Fit]:
        """Return how well each image is explained, were these of one frequency the corrupt ones."""
        first = int(self._look.earlier[0])
        start = choice[0] - (choice[0] - first) % PHASE_STEPS
        values = self._with_rebuilt(choice)[start : start + PHASE_STEPS, self._static]
        phasor = (values[0] - values[2]) / 2 + 0.5j * (values[1] - values[3])
        middle = self._middle[self._static]
        found = []
        for image in choice:
            turned = phasor * (-1j) ** (image - start)
            measured = self._look.values[image, self._static] - middle
            found.append(self._fit(turned, measured))
        return found

    def _fit(self, phasor: Array, measured: Array) -> _Fit:
        """Fit ``measured`` by Re(f phasor); the least f that does where several do."""
        a = np.stack([phasor.real, -phasor.imag]).astype(float)
        variance = 2 * (1.4826 * self._usual) ** 2
        normal = a @ a.T + variance * np.eye(2)
        re, im = np.linalg.solve(normal, a @ measured)
        left = measured - re * a[0] - im * a[1]
        off = measured - a[0]
        modulus = max(float(np.hypot(re, im)), 1e-6)
        error = np.sqrt(variance * (np.array([re, im]) @ np.linalg.solve(normal, [re, im])))
        return _Fit(
            complex(re, im),
            _TOLERANCE + 4 * float(error) / modulus,
            1 - float(left @ left) / max(float(off @ off), 1e-30),
            float(np.median(np.abs(left))) / max(self._usual, 1e-30),
        )

    def _best(
        self, chosen: dict[int, Choice], several: dict[int, list[Choice]]
    ) -> dict[int, Choice]:
        """Return the choices that make the moments agree best, where some do so clearly."""
        if not several or self._gains is None:
            return {}
        known = tuple(itertools.chain(*chosen.values()))
        options = list(itertools.product(*several.values()))
        scores = [self._disagreement(known + tuple(itertools.chain(*each))) for each in options]
        order = np.argsort(scores)
        if not scores[order[1]] - scores[order[0]] > _MARGIN:  # also where one is NaN
            return {}
        return dict(zip(several, options[order[0]], strict=True))

    def _contradicts(self, corrupt: Choice) -> bool:
        """Whether moments disagree with these images rebuilt: both of a pair were corrupt then.

        The frame before shows how well they agree in this scene; without it b_0 has to be
        measured, and moments may miss each other by their noise.
        """
        if not corrupt or self._gains is None:
            return False
        found = self._disagreement(corrupt)
        if self._before is not None:
            return bool(found - self._disagreement_of(self._before) > _CONTRADICTING)
        if self._zeroth == "estimated":
            return False
        first = int(self._look.earlier[0])
        steps = np.median(self._look.values[first:, self._static], axis=1)
        noise = _NOISE * self._usual / max(float(np.ptp(steps)), 1e-30)
        return bool(found > _CONTRADICTING + noise)

    def _disagreement(self, corrupt: Choice) -> float:
        return self._disagreement_of(self._with_rebuilt(corrupt))

    def _disagreement_of(self, images: Array) -> float:
        """Return by how much the moments of images (N, P) differ from those of few returns.

        The smallest eigenvalue over b_0 is 0 for sharp returns and negative where moments
        contradict each other. Where b_0 is not measured, its least possible value takes its place,
        and the mean modulus of the other moments, which a single return has, that of b_0. Groups
        of neighbours are averaged: noise makes eigenvalues smaller.
        """
        assert self._gains is not None  # noqa: S101  (callers have asked)
        values, gains = images[:, self._static], self._gains[:, self._static]
        b = calibrate(measure(values, zeroth=self._zeroth), gains)
        b = b[:, np.isfinite(b).all(axis=0)].astype(complex)
        b = b[:, : b.shape[1] // _GROUP * _GROUP].reshape((len(b), -1, _GROUP)).mean(axis=2)
        least = smallest_eigenvalue(b)
        if self._zeroth == "estimated":
            return float(np.median(-least / np.abs(b[1:]).mean(axis=0))) - 1
        return float(np.abs(np.median(least / b[0].real)))

    def _with_rebuilt(self, corrupt: Sequence[int]) -> Array:
        """Return the values with these images rebuilt."""
        values = self._look.values.copy()
        first = int(self._look.earlier[0])
        for image in corrupt:
            values[image] = 2 * self._middle - self._look.values[_opposite(image, first)]
        return values


def _opposite(image: int, first: int) -> int:
    """Return the image half a period from this one."""
    return image + 2 if (image - first) % PHASE_STEPS < 2 else image - 2


def _rebuilt(images: Array, image: int, first: int, corrupt: Array) -> Array:
    """Return an image as the sums nearest in time less the opposite image give it."""
    earlier = [k for k in range(first, len(images)) if (k - first) % PHASE_STEPS < 2]
    good = sorted(
        (k for k in earlier if not corrupt[k] and not corrupt[k + 2]), key=lambda k: abs(k - image)
    )
    good = good[: min(_NEAREST, len(good) - 1 + len(good) % 2)]  # an odd number of them
    wide = images[good + [k + 2 for k in good]].astype(float)
    with np.errstate(invalid="ignore"):  # pixels that are not finite stay so
        middle = np.median(wide[: len(good)] + wide[len(good) :], axis=0)
        rebuilt = middle - images[_opposite(image, first)]
    if images.dtype.kind in "iu":
        limits = np.iinfo(images.dtype)
        rebuilt = np.clip(rebuilt, max(limits.min, 0), limits.max)
    return rebuilt.astype(images.dtype)


def _values(images: Array, look: PairSums) -> Array:
    """Return the images (N, P) in the pixels that were looked at."""
    return images.reshape((len(images), -1))[:, look.pixels].astype(look.values.dtype)


def _at(calibration: Array, pixels: Array) -> Array:
    """Return the gains (m + 1, P) of some pixels."""
    gains = np.asarray(calibration)
    if gains.ndim == 1:
        return np.broadcast_to(gains[:, None], (len(gains), len(pixels)))
    return gains.reshape((len(gains), -1))[:, pixels]
