"""Faults that a device may have, of its lamp, lens and pixels; and other light that changes."""

import math
from abc import abstractmethod
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import ImageLabel, Sequence
from transientcam_simulation.base import LensScatter as Scattering
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

_Plane = NDArray[Any]
_Some = tuple[float, float]
_MOST_SPILLS = 64  # by then less than a hundredth is left


class _Fault(Effect):
    """One that is called for by how far figures move moments.

    ``reason`` is a format string of the figures, ``without`` what is said where there are none. On
    planes a fault costs nothing where the scene stands still.
    """

    reason: ClassVar[str]
    without: ClassVar[str] = "the device has no such fault"
    cost_s_per_pixel: ClassVar[float]

    @classmethod
    @abstractmethod
    def change(cls, conditions: Conditions, figures: Any, seen: Glimpse) -> Values:
        """Return how far moments (P) are off, at most."""

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where there are figures, and they move moments far enough."""
        figures = getattr(getattr(conditions, cls.holder), cls.figures)
        if not figures:
            return Call(False, cls.without, 0.0, 0.0)
        still = issubclass(cls, PlaneEffect) and not conditions.moves
        changes = tuple(cls.change(conditions, figures, each) for each in conditions.glimpses)
        drawn_s = 2e-5 if issubclass(cls, ShotEffect) else 0.0
        cost_s = 0.0 if still else drawn_s + conditions.pixels * cls.cost_s_per_pixel
        return weigh(conditions, changes, cls.reason.format(figures), cost_s)


class _StrayLight(_Fault, PlaneEffect):
    """Moves a share of the light, which may then have any phase."""

    local = False

    @staticmethod
    @abstractmethod
    def moved(figures: Any, plane: _Plane) -> _Plane:
        """Return where the light of a plane (H, W) goes."""

    @staticmethod
    def share(figures: Any) -> float:
        """Return how much of it goes there."""
        return float(figures)

    @classmethod
    def change(cls, conditions: Conditions, figures: Any, seen: Glimpse) -> Values:
        """Return what comes and what goes."""
        off = cls.share(figures) * (cls.moved(figures, seen.plane) + seen.plane)
        return np.asarray(off.ravel())

    def on_light(self, planes: LightPlanes) -> None:
        """Move it."""
        planes.move(self.share(self._figures), lambda plane: self.moved(self._figures, plane))


class LensScatter(_StrayLight):
    """A share of the light is spread by a wide Gaussian; light that leaves the image is lost."""

    name = "lens-scatter"
    what = "light goes astray in the lens"
    figures = "lens_scatter"
    reason = "{0.share:.1%} of the light goes astray"
    cost_s_per_pixel = 6e-8

    @staticmethod
    def share(figures: Scattering) -> float:
        """Return how much goes astray."""
        return figures.share

    @staticmethod
    def moved(figures: Scattering, plane: _Plane) -> _Plane:
        """Spread it."""
        rows, columns = (_spread(n, figures.width * plane.shape[1]) for n in plane.shape)
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


class Ghost(_StrayLight):
    """Surfaces of the lens mirror light through its axis."""

    name = "ghost"
    what = "the lens mirrors light through the middle of the image"
    figures = "ghost"
    reason = "{0:.2%} of the light goes to the opposite place"
    cost_s_per_pixel = 1e-8

    @staticmethod
    def moved(figures: float, plane: _Plane) -> _Plane:
        """Turn it by half a turn."""
        return plane[::-1, ::-1]


class Crosstalk(_StrayLight):
    """Light, or the charge that it makes, crosses to the four neighbours."""

    name = "crosstalk"
    what = "pixels get light of their neighbours"
    figures = "crosstalk"
    reason = "{0:.2%} of a pixel's light goes to its four neighbours"
    cost_s_per_pixel = 2e-8

    @staticmethod
    def moved(figures: float, plane: _Plane) -> _Plane:
        """Take the mean of the neighbours."""
        return _around(plane)


def _around(plane: _Plane) -> _Plane:
    """Return the mean of each pixel's four neighbours; beyond the edges it is its own."""
    wide = np.pad(plane, 1, mode="edge")
    four = wide[:-2, 1:-1] + wide[2:, 1:-1] + wide[1:-1, :-2] + wide[1:-1, 2:]
    return np.asarray(four / 4)


class Jitter(_Fault, ShotEffect):
    """Delay and power of the light differ from image to image: the floor of long averages."""

    name = "jitter"
    what = "no two images get quite the same light"
    figures = "jitter"
    reason = "{0[0]:.2g} s and {0[1]:.2%} of the power from image to image"
    cost_s_per_pixel = 2e-10

    @classmethod
    def change(cls, conditions: Conditions, figures: _Some, seen: Glimpse) -> Values:
        """Return what sums of four images b/2 (1 + cos) are off by."""
        delay_s, power = figures
        turned = 1 - math.exp(-((2 * math.pi * conditions.highest_hz * delay_s) ** 2) / 2)
        return math.sqrt((turned + 1.5 * power**2) / conditions.sequence.takes) * seen.brightness

    def on_shot(self, shot: Shot) -> None:
        """Draw both of an exposure."""
        late, more = _random(shot.seed, shot.exposure, 0x0072).standard_normal(2)
        shot.delay_s += self._figures[0] * late
        shot.power *= max(0.0, 1 + self._figures[1] * more)


class _SomePixels(_Fault, ImageEffect):
    """A share of the pixels has something of exponentially distributed size, by the device's seed.

    ``plane`` (H, W) is that size, for all scenes.
    """

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        random, (share, mean) = _random(conditions.device.seed, *self.name.encode()), self._figures
        sizes = random.exponential(mean, conditions.shape)
        self.plane = (sizes * (random.random(conditions.shape) < share)).astype(np.float32)

    @classmethod
    def change(cls, conditions: Conditions, figures: _Some, seen: Glimpse) -> Values:
        """Strew quantiles of the exponential density over the pixels."""
        (share, mean), sizes = figures, np.zeros(seen.brightness.size)
        count = math.ceil(share * len(sizes))
        places = np.linspace(0, len(sizes) - 1, count).astype(int)
        sizes[places] = -mean * np.log((np.arange(count) + 0.5) / count)
        return conditions.per_e * cls.noise_e(conditions, sizes)

    @staticmethod
    @abstractmethod
    def noise_e(conditions: Conditions, sizes: Values) -> Values:
        """Return the noise in electrons of pixels with so much of it."""


class HotPixels(_SomePixels):
    """Electrons that come without light, in some pixels; they have shot noise, too."""

    name = "hot-pixels"
    what = "some pixels fill up without light"
    figures = "hot_pixels"
    reason = "{0[0]:.2%} of the pixels have {0[1]:,.0f} electrons a second"
    cost_s_per_pixel = 2e-10

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self.plane *= np.float32(conditions.sequence.exposure_s)

    @staticmethod
    def noise_e(conditions: Conditions, sizes: Values) -> Values:
        """Return their shot noise: four images cancel their mean."""
        return np.sqrt(conditions.sequence.exposure_s * sizes)

    def apply(self, exposure: Exposure) -> None:
        """Add them."""
        exposure.signal += self.plane


class NoisyPixels(_SomePixels):
    """Further noise of the amplifiers of some pixels."""

    name = "noisy-pixels"
    what = "some pixels are read with more noise"
    figures = "noisy_pixels"
    reason = "{0[0]:.2%} of the pixels have {0[1]:,.0f} electrons of further noise"
    cost_s_per_pixel = 1.5e-9
    adds_variance = True

    @staticmethod
    def noise_e(conditions: Conditions, sizes: Values) -> Values:
        """Return it as it is."""
        return sizes

    def apply(self, exposure: Exposure) -> None:
        """Add its variance."""
        exposure.variance_e2 = exposure.variance_e2 + self.plane**2


class Blooming(_Fault, ImageEffect):
    """A share of the charge beyond a full well spills to the four neighbours."""

    name = "blooming"
    what = "full pixels spill charge to their neighbours"
    figures = "blooming"
    reason = "{0:.1%} of what is beyond a full well goes to the four neighbours"
    cost_s_per_pixel = 4e-8

    @classmethod
    def change(cls, conditions: Conditions, figures: float, seen: Glimpse) -> Values:
        """Return what one neighbour gets of a pixel that is over."""
        full = (conditions.sensor.full_well_e - conditions.white_e) / conditions.scale_e
        return figures / 4 * np.maximum(seen.brightness - full, 0)

    def apply(self, exposure: Exposure) -> None:
        """Spill, and on from there, until nothing is over; the rest is drained."""
        signal, full = exposure.signal, np.float32(self._sensor.full_well_e)
        for _ in range(_MOST_SPILLS):
            if signal.max() <= full:
                return
            over = np.maximum(signal - full, 0)
            signal += np.float32(self._figures) * _around(over) - over
        np.minimum(signal, full, out=signal)


class NonLinearity(_Fault, ImageEffect):
    """What is read lags behind the charge, by its square."""

    name = "non-linearity"
    what = "what is read lags behind the charge"
    figures = "non_linearity"
    reason = "{0:.2%} less at a full well"
    cost_s_per_pixel = 1.9e-9

    @classmethod
    def change(cls, conditions: Conditions, figures: float, seen: Glimpse) -> Values:
        """Return the part with the cosine of the square of b/2 (1 + cos)."""
        size_e = seen.brightness * conditions.scale_e + 2 * conditions.white_e * seen.reflectance
        return size_e * (figures * seen.brightness / conditions.sensor.full_well_e)

    def apply(self, exposure: Exposure) -> None:
        """Bend it, up to a full well."""
        signal, full = exposure.signal, np.float32(self._sensor.full_well_e)
        np.minimum(signal, full, out=signal)
        signal -= self._figures / full * signal**2


class _ChangingLight(_Fault, ShotEffect):
    """Other light, of which an image has more or less."""

    holder = "other_light"
    without = "no other light is so"
    cost_s_per_pixel = 7e-10

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self._sequence = conditions.sequence

    @staticmethod
    @abstractmethod
    def more(sequence: Sequence, figures: _Some, label: ImageLabel, begin_s: float) -> complex:
        """Return the share that an image of this label has more, by its real part."""

    @classmethod
    def change(cls, conditions: Conditions, figures: _Some, seen: Glimpse) -> Values:
        """Return what it does to the worst moment, as a root mean square over when frames begin."""
        left: dict[int, list[NDArray[np.complex128]]] = {}
        for n, label in enumerate(conditions.sequence.labels):
            if label.frequency_hz:  # not with the light on and off
                begin_s = n * conditions.image_period_s
                more = cls.more(conditions.sequence, figures, label, begin_s)
                turned = np.exp(1j * label.phase_rad) * np.array([more, np.conj(more)])
                left.setdefault(label.harmonic, []).append(turned)
        # both signs count by half in the mean square of a real part
        most = max(2 * float(np.linalg.norm(np.mean(each, axis=0))) for each in left.values())
        return most * conditions.white_e / conditions.scale_e * seen.reflectance

    def on_shot(self, shot: Shot) -> None:
        """Change it."""
        more = self.more(self._sequence, self._figures, shot.label, shot.device_time_s)
        shot.others += more.real


class Flicker(_ChangingLight):
    """Lamps that come and go, averaged over an exposure."""

    name = "flicker"
    what = "lamps that flicker"
    figures = "flicker"
    reason = "{0[0]:.0%} of the other light comes and goes at {0[1]:g} Hz"

    @staticmethod
    def more(sequence: Sequence, figures: _Some, label: ImageLabel, begin_s: float) -> complex:
        """Return what they have more on average over an exposure."""
        (share, hz), exposure_s = figures, sequence.exposure_s
        turn = 2j * np.pi * hz * (begin_s + exposure_s / 2)
        return complex(share * np.sinc(hz * exposure_s) * np.exp(turn))


class OtherCamera(_ChangingLight):
    """The lamp of another camera, whose modulation beats with this one's."""

    name = "other-camera"
    what = "another camera's modulated light"
    figures = "other_camera"
    reason = "{0[0]:.0%} of the other light is modulated at {0[1]:.9g} Hz"

    @staticmethod
    def more(sequence: Sequence, figures: _Some, label: ImageLabel, begin_s: float) -> complex:
        """Return what it brings to a correlation, part by part with its sub-phase."""
        (share, hz), begun, total = figures, 0.0, 0j
        beat_hz, parts = hz - label.frequency_hz, sequence.sub_phases
        for weight, sub_rad in zip(parts.weights, parts.phases_rad, strict=True):
            middle_s = begin_s + (begun + weight / 2) * sequence.exposure_s
            turn = 2 * np.pi * beat_hz * middle_s + label.phase_rad + sub_rad
            part = np.sinc(beat_hz * weight * sequence.exposure_s)
            total, begun = total + weight * part * np.exp(1j * turn), begun + weight
        return complex(share * total)


def _random(*words: int) -> np.random.Generator:
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(words)))
