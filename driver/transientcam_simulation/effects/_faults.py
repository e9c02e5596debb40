"""Faults of a device: rows of words, of what they change, and of what they do."""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import (
    Effect,
    Exposure,
    ImageEffect,
    LightPlanes,
    PlaneEffect,
    Shot,
    ShotEffect,
)
from transientcam_simulation.effects._glimpses import Glimpse, Values

_MOST_SPILLS = 64  # by then less than a hundredth is left
_Change = Callable[[Conditions, Any, Glimpse], Values]
_Drawn = Callable[[np.random.Generator, Any, Conditions], Values]


class _Fault(Effect):
    """One that is called for by how far the device's figures move moments.

    On planes it costs nothing where the scene stands still. ``plane`` is drawn from the device's
    seed, for all scenes.
    """

    reason: ClassVar[str]
    cost_s: ClassVar[float]
    change: ClassVar[Any]
    drawn: ClassVar[Any]

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        random = _random(conditions.device.seed, *self.name.encode())
        self.plane = self.drawn(random, self._figures, conditions).astype(np.float32)

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the device has the fault, and it moves moments far enough."""
        figures = getattr(conditions.device, cls.figures)
        if not figures:
            return Call(False, "the device has no such fault", 0.0, 0.0)
        still = issubclass(cls, PlaneEffect) and not conditions.moves
        changes = tuple(cls.change(conditions, figures, each) for each in conditions.glimpses)
        cost_s = 0.0 if still else conditions.pixels * cls.cost_s
        return weigh(conditions, changes, cls.reason.format(figures), cost_s)


def _fault(
    kind: Any,
    words: str,
    change: _Change,
    drawn: _Drawn = lambda random, figures, of: np.zeros(0),
    **does: Any,
) -> type[Effect]:
    """Make one: name | s a pixel of an image | what it is | why it is built, by its figures."""
    name, cost_s, what, reason = words.split(" | ")
    own = {"name": name, "figures": name.replace("-", "_"), "what": what, "reason": reason}
    of = {"change": staticmethod(change), "drawn": staticmethod(drawn), "cost_s": float(cost_s)}
    return type(name, (_Fault, kind), {**own, **of, **does, "__module__": __name__})


def _random(*words: int) -> np.random.Generator:
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(words)))


def _moved(words: str, moved: Callable[[Any, NDArray[Any]], NDArray[Any]]) -> type[Effect]:
    """Make one that moves a share of the light, which may then have any phase."""

    def on_light(self: Any, planes: LightPlanes) -> None:
        planes.move(share(self._figures), lambda plane: moved(self._figures, plane))

    def share(of: Any) -> Any:
        return getattr(of, "share", of)

    def change(_: Conditions, of: Any, seen: Glimpse) -> Values:
        return np.asarray(share(of) * (moved(of, seen.plane) + seen.plane).ravel())

    return _fault(PlaneEffect, words, change, local=False, on_light=on_light)


def _around(_: Any, plane: NDArray[Any]) -> NDArray[Any]:
    """Return the mean of each pixel's four neighbours; beyond the edges it is its own."""
    wide = np.pad(plane, 1, mode="edge")
    four = wide[:-2, 1:-1] + wide[2:, 1:-1] + wide[1:-1, :-2] + wide[1:-1, 2:]
    return np.asarray(four / 4)


def _astray(scatter: Any, plane: NDArray[Any]) -> NDArray[Any]:
    rows, columns = (_spread(n, scatter.width * plane.shape[1]) for n in plane.shape)
    return np.asarray(rows @ plane @ columns.T)


@lru_cache(maxsize=16)
def _spread(count: int, sigma: float) -> NDArray[np.float32]:
    """Matrix (count, count) whose columns spread a pixel's light; some falls beyond the edges."""
    pixels = np.arange(count)
    reach = np.arange(-4 * count, 5 * count)
    density = np.exp(-0.5 * ((pixels[:, None] - pixels[None, :]) / sigma) ** 2)
    # normalised over all places, not only those on the sensor
    spread = density / np.exp(-0.5 * (reach / sigma) ** 2).sum()
    return np.asarray(spread, dtype=np.float32)


def _strewn(figures: tuple[float, float], seen: Glimpse) -> Values:
    """Return what a share of the pixels has of something: quantiles of an exponential density."""
    (share, mean), sizes = figures, np.zeros(seen.brightness.size)
    count = math.ceil(share * len(sizes))
    places = np.linspace(0, len(sizes) - 1, count).astype(int)
    sizes[places] = -mean * np.log((np.arange(count) + 0.5) / count)
    return sizes


def _some(random: np.random.Generator, figures: tuple[float, float], of: Conditions) -> Values:
    share, mean = figures
    return random.exponential(mean, of.shape) * (random.random(of.shape) < share)


def _unsteady(of: Conditions, figures: tuple[float, float], seen: Glimpse) -> Values:
    """Return what sums of four images b/2 (1 + cos) with other delays and powers are off by."""
    delay_s, power = figures
    turned = 1 - math.exp(-((2 * math.pi * of.highest_hz * delay_s) ** 2) / 2)
    return math.sqrt((turned + 1.5 * power**2) / of.sequence.takes) * seen.brightness


def _draw_lamp(self: Any, shot: Shot) -> None:
    late, more = _random(shot.seed, shot.exposure, 0x0072).standard_normal(2)
    shot.delay_s += self._figures[0] * late
    shot.power *= max(0.0, 1 + self._figures[1] * more)


def _spill(self: Any, exposure: Exposure) -> None:
    """Spill to the neighbours, and on from there, until nothing is over; the rest is drained."""
    signal, full = exposure.signal, np.float32(self._sensor.full_well_e)
    for _ in range(_MOST_SPILLS):
        if signal.max() <= full:
            return
        over = np.maximum(signal - full, 0)
        signal += np.float32(self._figures) * _around(None, over) - over
    np.minimum(signal, full, out=signal)


def _add_noise(self: Any, exposure: Exposure) -> None:
    exposure.variance_e2 = exposure.variance_e2 + self.plane**2


def _bend(self: Any, exposure: Exposure) -> None:
    signal, full = exposure.signal, np.float32(self._sensor.full_well_e)
    np.minimum(signal, full, out=signal)
    signal -= self._figures / full * signal**2


LensScatter = _moved(
    "lens-scatter | 6e-8 | light goes astray in the lens | {0.share:.1%} of the light goes astray",
    _astray,
)
Ghost = _moved(
    "ghost | 1e-8 | the lens mirrors light through the middle of the image | "
    "{0:.2%} of the light goes to the opposite place",
    lambda _, plane: plane[::-1, ::-1],
)
Crosstalk = _moved(
    "crosstalk | 2e-8 | pixels get light of their neighbours | "
    "{0:.2%} of a pixel's light goes to its four neighbours",
    _around,
)
Jitter = _fault(
    ShotEffect,
    "jitter | 1e-9 | no two images get quite the same light | "
    "{0[0]:.2g} s and {0[1]:.2%} of the power from image to image",
    _unsteady,
    on_shot=_draw_lamp,
)
HotPixels = _fault(
    ImageEffect,
    "hot-pixels | 7e-10 | some pixels fill up without light | "
    "{0[0]:.2%} of the pixels have {0[1]:.3g} electrons a second",
    lambda of, figures, seen: of.per_e * np.sqrt(of.sequence.exposure_s * _strewn(figures, seen)),
    lambda random, figures, of: of.sequence.exposure_s * _some(random, figures, of),
    apply=lambda self, exposure: np.add(exposure.signal, self.plane, out=exposure.signal),
)
Blooming = _fault(
    ImageEffect,
    "blooming | 4e-8 | full pixels spill charge to their neighbours | "
    "{0:.1%} of what is beyond a full well goes to the four neighbours",
    lambda of, share, seen: (
        share
        / 4
        * np.maximum(seen.brightness - (of.sensor.full_well_e - of.white_e) / of.scale_e, 0)
    ),
    apply=_spill,
)
NoisyPixels = _fault(
    ImageEffect,
    "noisy-pixels | 1.7e-9 | some pixels are read with more noise | "
    "{0[0]:.2%} of the pixels have {0[1]:.3g} electrons of further noise",
    lambda of, figures, seen: of.per_e * _strewn(figures, seen),
    _some,
    adds_variance=True,
    apply=_add_noise,
)
NonLinearity = _fault(
    ImageEffect,
    "non-linearity | 3e-9 | what is read lags behind the charge | {0:.2%} less at a full well",
    # the part with the cosine of the square of b/2 (1 + cos)
    lambda of, lack, seen: (
        (seen.brightness * of.scale_e + 2 * of.white_e * seen.reflectance)
        * (lack * seen.brightness / of.sensor.full_well_e)
    ),
    apply=_bend,
)
