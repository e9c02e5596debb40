"""Imperfections of a model of camera, and of one unit of it.

The figures of ``PROTOTYPE`` are those of the CamBoard nano family, on which the paper's camera is
built, as far as they are known; the rest is chosen, and marked so.
"""

from dataclasses import dataclass, replace
from pathlib import Path


@dataclass(frozen=True, slots=True)
class RollOff:
    """Amplitude of the modulation relative to that of an ideal one, over frequency.

    Interpolated between the frequencies given, constant beyond them.
    """

    frequency_hz: tuple[float, ...]
    amplitude: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Waveform:
    """Harmonics of the correlation of light and reference, relative to the fundamental.

    Either from a measured correlation function, a (rows, samples) .npy over one period, or by
    the third harmonic's amplitude over the fundamental frequency.
    """

    file: Path | None = None
    frequency_hz: tuple[float, ...] = ()
    third_harmonic: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Pattern:
    """Differences between pixels: a delay of the clock, and a gain.

    ``file`` holds phase offsets of a real board at ``file_frequency_hz``; without one the delays
    are drawn from the device's seed. ``delay_s`` and ``gain`` are standard deviations.
    """

    delay_s: float = 0.0
    gain: float = 0.0
    file: Path | None = None
    file_frequency_hz: float = 23e6


@dataclass(frozen=True, slots=True)
class Drift:
    """The device warms up after it is switched on, by ``rise_c`` in the end.

    The light is delayed by ``delay_s_per_c`` for each degree above the start.
    """

    rise_c: float
    time_constant_s: float
    delay_s_per_c: float


@dataclass(frozen=True, slots=True)
class Outliers:
    """Images whose modulation loses its synchronisation: ``share`` of all (Sec. 6)."""

    share: float


@dataclass(frozen=True, slots=True)
class LensScatter:
    """A share of the light is scattered in the lens, over a Gaussian of this width.

    ``width`` is a standard deviation, as a share of the image's width.
    """

    share: float
    width: float


@dataclass(frozen=True, slots=True)
class DarkCurrent:
    """Electrons that come without light, the same in every pixel."""

    electrons_per_s: float


@dataclass(frozen=True, slots=True)
class OtherLight:
    """How light that is not the camera's own changes; None where it does not.

    A share of it that comes and goes at a frequency in Hz, as a cosine of the device's time; and
    one of another camera's lamp, which is modulated at a frequency in Hz.
    """

    flicker: tuple[float, float] | None = None
    other_camera: tuple[float, float] | None = None


STEADY, TYPICAL_OTHER_LIGHT = OtherLight(), OtherLight((0.2, 100.0), (0.5, 23e6 + 60))


@dataclass(frozen=True, slots=True)
class Lens:
    """How a lens departs from a pinhole."""

    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    """k1, k2, p1, p2, k3 of Brown's model, in units of the focal length: a point at (x, y) before
    the lens is seen at x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2), and likewise
    in y, which points up."""
    centre: tuple[float, float] = (0.0, 0.0)
    """Where the axis meets the image, right of and below its middle, in widths of the image."""
    vignetting: float = 0.0
    """Light falls with this power of the cosine to the axis; 4 is that of a thin lens."""

    @property
    def bends(self) -> bool:
        """Whether it shows places elsewhere than a pinhole does."""
        return any(self.distortion) or any(self.centre)


PINHOLE = Lens()


@dataclass(frozen=True, slots=True)
class DeviceProfile:
    """One unit of a model; None where it is perfect.

    ``seed`` is that of the unit: its pattern stays when the scene changes.
    """

    name: str
    waveform: Waveform | None = None
    roll_off: RollOff | None = None
    pattern: Pattern | None = None
    drift: Drift | None = None
    outliers: Outliers | None = None
    lens_scatter: LensScatter | None = None
    dark_current: DarkCurrent | None = None
    jitter: tuple[float, float] | None = None
    """Standard deviations from image to image, of the light's delay in s and of its power."""
    ghost: float | None = None
    crosstalk: float | None = None
    """Shares of the light that go to the opposite place, and to a pixel's four neighbours."""
    blooming: float | None = None
    """Share of the charge beyond a full well that goes to the four neighbours."""
    hot_pixels: tuple[float, float] | None = None
    noisy_pixels: tuple[float, float] | None = None
    """Shares of the pixels, and means of exponentially distributed electrons a second, or noise."""
    non_linearity: float | None = None
    """Share of a full well that it reads less, by the square of the charge."""
    seed: int = 0

    def described(self, lens: Lens) -> str:
        """Name the profile, and what of this unit and its lens differs from it."""
        profile = replace(PROFILES[self.name], seed=self.seed)
        own = [name for name in self.__slots__ if getattr(self, name) != getattr(profile, name)]
        own += ["lens"] if lens != PINHOLE else []
        words = ", ".join(own).replace("_", " ")
        return f"{self.name} (but for {words})" if own else self.name


IDEAL = DeviceProfile("ideal")

PROTOTYPE = DeviceProfile(
    "prototype",
    # measured third harmonics and amplitudes; the latter relative to that at 11.5 MHz
    waveform=Waveform(
        frequency_hz=(11.5e6, 23e6, 46e6, 69e6, 92e6),
        third_harmonic=(0.092, 0.111, 0.032, 0.029, 0.006),
    ),
    roll_off=RollOff(
        frequency_hz=(11.5e6, 23e6, 34.5e6, 46e6, 57.5e6, 69e6, 80.5e6, 92e6, 103.5e6, 115e6),
        amplitude=(1.0, 0.959, 0.911, 0.951, 0.927, 0.715, 0.512, 0.553, 0.553, 0.057),
    ),
    # 10 degrees at 23 MHz, as on a real board of the same kind; the gain is chosen
    pattern=Pattern(delay_s=1.2e-9, gain=0.01),
    # chosen: of a small camera without a fan
    drift=Drift(rise_c=12.0, time_constant_s=300.0, delay_s_per_c=4e-12),
    outliers=Outliers(share=0.07),  # "5-10 % of all captured images" (Sec. 6)
    lens_scatter=LensScatter(share=0.02, width=0.15),  # chosen
)

TYPICAL = replace(
    PROTOTYPE, name="typical", dark_current=DarkCurrent(2e5), jitter=(2e-11, 5e-3), ghost=0.01,
    crosstalk=0.02, blooming=0.3, hot_pixels=(1e-3, 1e6), noisy_pixels=(1e-3, 300.0),
    non_linearity=0.02,
)  # fmt: skip
"""The prototype, and chosen figures of what is not known of it: for effects that are forced on."""
TYPICAL_LENS = Lens((-0.12, 0.02, 0.0, 0.0, 0.0), (0.0, 0.0), 4.0)

PROFILES = {profile.name: profile for profile in (IDEAL, PROTOTYPE)}
