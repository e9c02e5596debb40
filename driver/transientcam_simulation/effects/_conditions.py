"""What effects are judged by, and the judgement."""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np

from transientcam_driver.camera import Sensor
from transientcam_driver.sequence import LOW_FREQUENCY_HZ, Sequence, SubPhases
from transientcam_simulation.base import IDEAL, PINHOLE, STEADY, DeviceProfile, Lens, OtherLight
from transientcam_simulation.effects._glimpses import Facts, Glimpse, Noise, Values

CALLED_ABOVE = 0.1
"""Effects are called for above this share of the noise, as a root mean square over the lit pixels.

An error of a tenth of the noise adds half a percent to it (errors add up in squares).
"""
WORST_ABOVE = 0.25
"""And above this share of its own noise in any pixel that was judged.

Two effects that are left out then change no pixel by more than half its noise.
"""


@dataclass(frozen=True)
class Conditions:
    """The conditions an effect is judged by: sensor, sequence, device, and the scene's light.

    ``glimpses`` are pixels at several times of the scene's life, ``facts`` how effects change
    their light (None if there is no geometry). ``white_e`` are electrons of unmodulated light in
    each image of a white surface; ``cosine`` (H, W) is that of pixels' rays to the lens's axis.
    """

    sensor: Sensor
    sequence: Sequence
    scale_e: float
    glimpses: tuple[Glimpse, ...]
    white_e: float = 0.0
    other_light: OtherLight = STEADY
    image_period_s: float = 0.0
    device: DeviceProfile = IDEAL
    lens: Lens = PINHOLE
    facts: Facts | None = None
    cosine: Values = field(default_factory=lambda: np.ones((1, 1)))
    moves: bool = False

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the image."""
        return self.cosine.shape[0], self.cosine.shape[1]

    @property
    def pixels(self) -> int:
        """How many the image has."""
        return self.cosine.size

    @cached_property
    def noise(self) -> Noise:
        """Noise of a moment by the brightness of its pixel, without other light."""
        sensor = self.sensor
        dark_e2 = sensor.read_noise_e**2 + sensor.gain_e_per_dn**2 / 12
        return Noise(self.scale_e, 0.0, dark_e2, self.sequence.takes)

    @cached_property
    def _typical(self) -> tuple[float, float]:
        """Mean brightness and reflectance of the lit pixels over the scene's life."""
        lit = np.concatenate([each.brightness[each.lit] for each in self.glimpses])
        reflectance = np.concatenate([each.reflectance[each.lit] for each in self.glimpses])
        return (float(lit.mean()), float(reflectance.mean())) if lit.size else (0.0, 0.0)

    @property
    def brightness_e(self) -> float:
        """Zeroth moment of a typical pixel in electrons."""
        return self._typical[0] * self.scale_e

    @property
    def brightest_e(self) -> float:
        """The highest zeroth moment over the scene's life."""
        return max(float(each.brightness.max(initial=0.0)) for each in self.glimpses) * self.scale_e

    @property
    def ambient_e(self) -> float:
        """Electrons of other light in each image of a typical pixel."""
        reflectance = np.concatenate([each.reflectance for each in self.glimpses])
        return self.white_e * float(reflectance.mean())

    @property
    def mean_e(self) -> float:
        """Electrons of a typical pixel in one image, averaged over the phases."""
        return self.brightness_e / 2 + self.ambient_e

    @property
    def floor_dn(self) -> float:
        """The noise floor: root mean square error of one complex moment of a typical pixel.

        Of shot noise, read noise and rounding, averaged over the takes.
        """
        noise = replace(self.noise, white_e=self.ambient_e)
        relative = noise.deviation(self._typical[0], 1.0)
        return float(relative) * self.scale_e / self.sensor.gain_e_per_dn

    @property
    def highest_hz(self) -> float:
        """The highest frequency that is measured."""
        return self.sequence.harmonics * self.sequence.base_frequency_hz

    @property
    def frequencies_hz(self) -> tuple[float, ...]:
        """All frequencies that are measured."""
        f_hz = self.sequence.base_frequency_hz
        measured = tuple(j * f_hz for j in range(1, self.sequence.harmonics + 1))
        return ((LOW_FREQUENCY_HZ,) if self.sequence.zeroth == "low-frequency" else ()) + measured

    @property
    def sequence_s(self) -> float:
        """Time from the first image of the sequence to the last."""
        return (self.sequence.images - 1) * self.image_period_s

    def sub_phase_gain(self, harmonic: int) -> complex:
        """G_k: gain of a harmonic by the division of the exposure (Sec. 4.1)."""
        return _sub_phase_gain(self.sequence.sub_phases, harmonic)

    @property
    def negligible(self) -> float:
        """Brightness that changes no moment by more than a tenth of the noise of a dark pixel."""
        return CALLED_ABOVE * float(self.noise.deviation(0.0, 0.0))

    @property
    def per_e(self) -> float:
        """Error of a moment by one electron's in each image."""
        return 2 / math.sqrt(self.sequence.takes) / self.scale_e

    def of_light(self, share: float) -> tuple[Values, ...]:
        """Return a change by the same share of the light in every pixel, by glimpse."""
        return tuple(share * each.brightness for each in self.glimpses)

    def changes(self, effect: str) -> tuple[Values, ...]:
        """Return how far an effect of light moves the moments, by glimpse; empty if nowhere."""
        if self.facts is None:
            return ()
        during_s = self.sequence.exposure_s if effect == "blur" else self.sequence_s
        return self.facts.changes(effect, self.frequencies_hz, during_s=during_s)


@lru_cache(maxsize=64)
def _sub_phase_gain(sub_phases: SubPhases, harmonic: int) -> complex:
    phases = np.array(sub_phases.phases_rad)
    return complex(np.sum(sub_phases.weights * np.exp(-1j * harmonic * phases)))


@dataclass(frozen=True, slots=True)
class Call:
    """Whether an effect is called for, and why.

    ``size_dn`` is the error it causes in one moment, as a root mean square over the lit pixels in
    digital numbers at the worst of the times judged; ``relative`` the same of the errors over each
    pixel's own noise, and ``worst`` the largest of them; ``cost_s`` what one image costs, by the
    order of magnitude.
    """

    called: bool
    reason: str
    size_dn: float
    cost_s: float
    relative: float = 0.0
    worst: float = 0.0


def weigh(
    conditions: Conditions, changes: tuple[Values, ...], reason: str, cost_s: float = 0.0
) -> Call:
    """Call for an effect that changes moments (P), by glimpse, too far against their noise.

    ``{share}`` in the reason becomes the share of the lit pixels that change so far, at the time
    when most do.
    """
    size = relative = worst = share = 0.0
    for glimpse, change in zip(conditions.glimpses, changes, strict=True):
        counted = glimpse.lit | (change > 0)
        if not counted.any():
            continue
        moved = change[counted]
        noise = replace(conditions.noise, white_e=conditions.white_e)
        deviation = noise.deviation(glimpse.brightness[counted], glimpse.reflectance[counted])
        size = max(size, math.sqrt(np.mean(moved**2)))
        relative = max(relative, math.sqrt(np.mean((moved / deviation) ** 2)))
        worst = max(worst, float((moved / deviation).max()))
        share = max(share, float(np.mean(moved > WORST_ABOVE * deviation)))
    called = relative > CALLED_ABOVE or worst > WORST_ABOVE
    size_dn = size * conditions.scale_e / conditions.sensor.gain_e_per_dn
    words = f"{share:.1%}" if share >= 1e-3 or not share else "less than 0.1%"
    return Call(called, reason.format(share=words), size_dn, cost_s, relative, worst)


def always(conditions: Conditions, size_dn: float, reason: str, cost_s: float) -> Call:
    """Call for what is physics of the sensor, whatever its size."""
    relative = size_dn / conditions.floor_dn
    return Call(True, reason, size_dn, cost_s, relative, relative)
