"""The scene as predictions see it: light, returns and true range of typical pixels.

Scenes have pixels of several kinds: a wall and a piece of wax before it. The median over all is
somewhere among those of one kind, at a place that depends on how many there are of the other. Drawn
by chance, 128 pixels know that share to 4 %; taken evenly from lit pixels in the order of their
kind, to less than 1 %. What these few leave undecided is decided by eight times as many.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

import transientcam_moments as tm
from transientcam_moments.moment_problem import DIRECT_THRESHOLD
from transientcam_server.errors import Problem, kinds

_Array = NDArray[Any]
STRATUM: Final = 8
"""Pixels of the sample that are of one kind, from the dimmest to the brightest."""


def typical_pixels(b: _Array, count: int) -> _Array:
    """Return which of N pixels stand for all, ``count`` of them, by their kind.

    ``b``: (m + 1, N) moments of the lit pixels.
    ``count``: A multiple of `STRATUM`; pixels are taken repeatedly where there are fewer.
    """
    strata = _evenly(np.argsort(coherence(b), kind="stable"), count // STRATUM)
    light = np.abs(b[1])
    chosen = [_middles(each[np.argsort(light[each], kind="stable")]) for each in strata]
    return np.concatenate(chosen)


def one_of_each(count: int) -> _Array:
    """Return which of ``count`` pixels of `typical_pixels` stand for them, `STRATUM` times fewer.

    One of each kind, dim and bright ones by turns.
    """
    kind = np.arange(count // STRATUM)
    return np.asarray(kind * STRATUM + (3 * kind + kind // STRATUM) % STRATUM)


def coherence(b: _Array) -> _Array:
    """Return how much the moments (m + 1, N) are those of one return: 1 where they are.

    That is the modulus of their mean, each turned back by the phase of the first and over its
    modulus.
    """
    m = len(b) - 1
    size = np.maximum(np.abs(b[1]), 1e-12)
    back = np.conj(b[1]) / size
    j = np.arange(1, m + 1)[:, None]
    found: _Array = np.abs((b[1:] * back**j).sum(axis=0)) / (m * size)
    return found


def _evenly(order: _Array, parts: int) -> list[_Array]:
    """Cut an order into so many parts, which share elements where there are too few."""
    edges = np.linspace(0, order.size, parts + 1)
    return [
        order[int(low) : max(int(high), int(low) + 1)] for low, high in itertools.pairwise(edges)
    ]


def _middles(order: _Array) -> _Array:
    """Return `STRATUM` elements at equal distances."""
    places = (np.arange(STRATUM) + 0.5) / STRATUM * order.size
    return np.asarray(order[places.astype(int)])


_WORDS = "x, y, width, height of a box, or 3 to 64 corners x, y of a polygon, in whole pixels"


@dataclass(frozen=True, slots=True)
class Region:
    """The pixels that a polygon of columns and rows holds, those on its edges too."""

    corners: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, value: str | Sequence[Any] | None) -> "Region | None":
        """Return a region of four numbers or of corners; as text ``x,y,w,h`` or ``x,y/x,y/x,y``.

        Problem ``invalid-request`` for anything else; None for None.
        """
        if value is None:
            return None
        try:
            if isinstance(value, str):
                parts = [part.split(",") for part in value.split("/")]
                numbers = [[int(each) for each in part] for part in parts]
            else:
                corners_or_box: Any = [value] if np.ndim(value) == 1 else value
                numbers = [list(each) for each in corners_or_box]
            if len(numbers) == 1:
                x, y, width, height = numbers[0]
                if width < 1 or height < 1:
                    raise _refused(value)
                numbers = [[x, y], [x + width - 1, y], [x + width - 1, y + height - 1]]
                numbers.append([x, y + height - 1])
            corners = tuple((column, row) for column, row in numbers)
        except (TypeError, ValueError):
            raise _refused(value) from None
        whole = all(isinstance(each, int) and each >= 0 for corner in corners for each in corner)
        if not whole or not 3 <= len(corners) <= 64:
            raise _refused(value)
        return cls(corners)

    def mask(self, height: int, width: int) -> NDArray[np.bool_]:
        """Return which pixels (H, W) are within; ``invalid-request`` if a corner is outside."""
        if any(x >= width or y >= height for x, y in self.corners):
            raise _refused(self.to_document(), f", within {width} x {height} pixels")
        image = Image.new("1", (width, height))
        ImageDraw.Draw(image).polygon(self.corners, fill=1, outline=1)
        return np.array(image)

    def to_document(self) -> list[list[int]]:
        """Return the corners as JSON."""
        return [list(corner) for corner in self.corners]


def _refused(value: Any, where: str = "") -> Problem:
    detail = f"region must be {_WORDS}{where}."
    return Problem(kinds.INVALID_REQUEST, detail, field="region", value=value, limit=_WORDS + where)


PIXELS: Final = 1024
"""How many lit pixels stand for a scene, a multiple of `sampling.STRATUM` squared."""
FEW_PIXELS: Final = PIXELS // STRATUM
"""How many of them nearly all is predicted with."""
MOSTLY_DIM: Final = 0.25
"""Share of dim pixels from which on it matters to the median one."""
AMBIGUOUS_SHARE: Final = 0.02
"""Share of the pixels whose direct return may lie beyond the unambiguous range."""
LATE_SHARE: Final = 0.05
"""Share of those with a later return beyond it, which is then taken for the direct one."""


@dataclass(frozen=True, slots=True, eq=False)
class SceneStatistics:
    """Typical lit pixels of a scene, P of them.

    ``brightness_dn_per_s``: (P) zeroth moment b_0 in DN for each second of exposure.
    ``ambient_dn_per_s``: (P) light that is not the camera's, in DN an image for each second of
    exposure.
    ``brightest_dn_per_s``: What the brightest pixels of an image hold above the dark level, ambient
    light included; they must not saturate.
    ``direct_m``: (P) range of the direct return.
    ``uncertainty_m``: (P) by how much that may be wrong: what the look at the scene did not
    resolve.
    ``earliest_m``, ``latest_m``: (P) between which ranges the direct return lies: what the moments
    do not contradict.
    ``delay_s``, ``share``: (K, P) returns: time of flight (NaN where unused) and share of the
    pixel's light (0 where unused). What the shares leave to 1 comes back evenly at all times.
    ``measured``: (M + 1, P) measured moments over the brightness, at multiples of
    `base_frequency_hz`; None where the returns are given exactly.
    ``again``: The shape of the light anew, by `direct_m` to `measured`, once the noise of the look
    is added to what it saw, in several draws; empty of a look that has hardly any.
    ``relative_noise``: (P) deviation of these moments over the brightness.
    ``lit_share``: Share of all pixels whose light stands clear of the noise.
    ``dim_share``: Share of the lit pixels that other surfaces may light alone.
    ``moving_share``: Share of the lit pixels that changed while the scene was looked at.
    ``ambiguity_checked``: Whether `direct_m` is known not to be short by a multiple of the
    unambiguous range.
    ``contrast``: What the device leaves of its modulation at multiples 0 to M of
    `base_frequency_hz`; empty where that is everything.
    ``calibrated``: Whether what was seen is known to be the scene's, and not the device's.
    ``uncalibrated_m``: How far ranges are off without a calibration, in the median pixel.
    ``lost_share``: Share of the images that lose their synchronisation.
    ``drift_m``: By how much ranges may have drifted since the calibration in use, without a sign.
    ``swing_m_per_s``: (P) how fast the ranges of lit pixels change, these or others; None where
    nothing moves.
    ``of_one_frame``: Whether no look was taken, but one frame of another purpose.
    ``pixels``: (P) places of the pixels in the picture, row by row; None of a scene that is given.
    ``shape``: Height and width of the picture.
    ``picture``: (M + 1, H, W) measured moments of all pixels, in DN for each second of exposure;
    None of a scene that is given.
    ``seen``: Describes pixels within a mask (H, W), None for all: typical ones or, with ``every``,
    each lit one; None of a scene that is given, or if none is lit.
    """

    brightness_dn_per_s: _Array
    ambient_dn_per_s: _Array
    brightest_dn_per_s: float
    direct_m: _Array
    uncertainty_m: _Array
    earliest_m: _Array
    latest_m: _Array
    delay_s: _Array
    share: _Array
    base_frequency_hz: float = 0.0
    measured: _Array | None = None
    again: tuple[dict[str, Any], ...] = ()
    relative_noise: _Array | None = None
    lit_share: float = 1.0
    dim_share: float = 0.0
    moving_share: float = 0.0
    ambiguity_checked: bool = True
    contrast: tuple[float, ...] = ()
    calibrated: bool = True
    uncalibrated_m: float = 0.0
    lost_share: float = 0.0
    drift_m: float = 0.0
    swing_m_per_s: _Array | None = None
    of_one_frame: bool = False
    pixels: _Array | None = None
    shape: tuple[int, int] = (0, 0)
    picture: _Array | None = None
    seen: "Callable[..., SceneStatistics | None] | None" = None

    def few(self) -> "SceneStatistics":
        """Return what fewer pixels show, `FEW_PIXELS` of them."""
        count = self.direct_m.size
        if count <= FEW_PIXELS:
            return self
        chosen = one_of_each(count)
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        of_pixels: dict[str, Any] = {
            name: value[..., chosen]
            for name, value in values.items()
            if isinstance(value, np.ndarray) and name != "picture"
        }
        again = tuple({name: x[..., chosen] for name, x in each.items()} for each in self.again)
        return replace(self, **of_pixels, again=again)

    def within(self, region: Region | None, *, every: bool = False) -> "SceneStatistics":
        """Return what is seen in a region, by typical pixels or by ``every`` lit one.

        Problem ``invalid-request`` where the picture does not hold it, or none was seen, and
        ``target-unreachable`` where nothing is lit in it.
        """
        if region is None and not every:
            return self
        if self.seen is None:
            detail = "A scene that is given has no picture, and so no region of it."
            raise Problem(kinds.INVALID_REQUEST, detail, field="region", value=None, limit=None)
        mask = None if region is None else region.mask(*self.shape)
        scene = self.seen(mask, every=every)
        if scene is None:
            raise Problem(
                kinds.TARGET_UNREACHABLE,
                "No pixel of the region has light that stands clear of the noise.",
                field="region",
                value=None if region is None else region.to_document(),
                best=None,
            )
        kept = ("seen", "shape", "drift_m", "lost_share", "of_one_frame")
        return replace(scene, **{name: getattr(self, name) for name in kept})

    def brighter(self, times: float) -> "SceneStatistics":
        """Return the same scene with so many times the camera's own light."""
        ambient = float(np.median(self.ambient_dn_per_s))
        return replace(
            self,
            brightness_dn_per_s=times * self.brightness_dn_per_s,
            brightest_dn_per_s=times * (self.brightest_dn_per_s - ambient) + ambient,
        )

    def to_document(self) -> dict[str, Any]:
        """Return what was seen, as JSON."""
        return {
            "range_m": float(np.median(self.direct_m)),
            "brightness_dn_per_s": float(np.median(self.brightness_dn_per_s)),
            "ambient_dn_per_s": float(np.median(self.ambient_dn_per_s)),
            "lit_share": self.lit_share,
            "dim_share": self.dim_share,
            "moving_share": self.moving_share,
            "ambiguity_checked": self.ambiguity_checked,
            "calibrated": self.calibrated,
            "uncalibrated_m": self.uncalibrated_m,
            "lost_share": self.lost_share,
            "drift_m": self.drift_m,
            "of_one_frame": self.of_one_frame,
        }

    @property
    def lit_in_part(self) -> bool:
        """Whether so many pixels may be lit by other surfaces alone that no range is certain."""
        return self.dim_share >= MOSTLY_DIM

    @property
    def disagreement_m(self) -> float:
        """What the look did not resolve of the direct range, in the median pixel."""
        found = float(np.median(self.uncertainty_m))
        noisier = [float(np.median(each["uncertainty_m"])) for each in self.again] or [found]
        return math.sqrt(max(0.0, 2 * found**2 - float(np.square(noisier).mean())))

    def contrast_at(self, harmonics: int, base_frequency_hz: float) -> _Array:
        """Return what the device leaves of its modulation (m + 1) at multiples of a frequency."""
        if len(self.contrast) < 2:
            return np.ones(harmonics + 1)
        j, known = np.arange(harmonics + 1), np.arange(len(self.contrast))
        found = np.interp(j * base_frequency_hz, known * self.base_frequency_hz, self.contrast)
        return np.where(j == 0, 1.0, found)

    def covers(self, harmonics: int, base_frequency_hz: float) -> bool:
        """Whether moments at these frequencies are known without a model of the returns."""
        if self.measured is None:
            return True
        multiple = self._multiple(base_frequency_hz)
        return multiple > 0 and multiple * harmonics < len(self.measured)

    def relative_moments(self, harmonics: int, base_frequency_hz: float) -> _Array:
        """Return moments (m + 1, P) of pixels with a brightness of 1."""
        if self.measured is not None and self.covers(harmonics, base_frequency_hz):
            step = self._multiple(base_frequency_hz)
            return np.array(self.measured[: step * harmonics + 1 : step])
        j = np.arange(harmonics + 1)[:, None, None]
        phase = 2 * np.pi * base_frequency_hz * np.nan_to_num(self.delay_s)
        moments = (self.share * np.exp(1j * j * phase)).sum(axis=1)
        moments[0] = 1.0
        return np.asarray(moments, np.complex64)

    def ambiguous(self, unambiguous_range_m: float) -> bool:
        """Whether ranges beyond this one are too frequent, of the direct or of later returns.

        Returns too weak to be taken for the direct one do not count.
        """
        counts = (self.share >= DIRECT_THRESHOLD * self.share.max(axis=0)) & (self.share > 0)
        late_m = np.where(counts, tm.SPEED_OF_LIGHT_M_S / 2 * np.nan_to_num(self.delay_s), 0.0)
        late = (late_m >= unambiguous_range_m).any(axis=0)
        direct = self.direct_m >= unambiguous_range_m
        still = 1 - self.moving_share  # what moves is left out here, and not of the picture
        return bool(still * direct.mean() > AMBIGUOUS_SHARE or still * late.mean() > LATE_SHARE)

    def _multiple(self, base_frequency_hz: float) -> int:
        """Return which multiple of the base frequency of the look this is; 0 where it is none."""
        if self.base_frequency_hz <= 0:
            return 0
        ratio = base_frequency_hz / self.base_frequency_hz
        nearest = round(ratio)
        return nearest if abs(ratio - nearest) < 1e-6 * ratio else 0


def uniform_scene(
    brightness_dn_per_s: float,
    returns: Iterable[tuple[float, float]],
    *,
    ambient_dn_per_s: float = 0.0,
) -> SceneStatistics:
    """Describe a scene of equal pixels.

    ``brightness_dn_per_s``: b_0 in DN for each second of exposure.
    ``returns``: Range in m and relative weight of each.
    ``ambient_dn_per_s``: As in `SceneStatistics`.
    """
    range_m, weight = np.array(list(returns), dtype=float).T
    repeated = (len(range_m), FEW_PIXELS)
    delay_s = np.broadcast_to(2 * range_m[:, None] / tm.SPEED_OF_LIGHT_M_S, repeated)
    share = np.broadcast_to(weight[:, None] / weight.sum(), repeated)
    counts = weight >= DIRECT_THRESHOLD * weight.max()
    direct_m = np.full(FEW_PIXELS, range_m[counts].min())
    return SceneStatistics(
        brightness_dn_per_s=np.full(FEW_PIXELS, brightness_dn_per_s),
        ambient_dn_per_s=np.full(FEW_PIXELS, ambient_dn_per_s),
        brightest_dn_per_s=brightness_dn_per_s + ambient_dn_per_s,
        direct_m=direct_m,
        uncertainty_m=np.zeros(FEW_PIXELS),
        earliest_m=direct_m,
        latest_m=direct_m,
        delay_s=delay_s,
        share=share,
    )
