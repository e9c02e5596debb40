"""The scene as predictions see it: brightness and returns of typical pixels."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm

_Array = NDArray[Any]
PIXELS: Final = 256
"""How many pixels stand for a scene."""
BRIGHT_SHARE: Final = 0.99
"""Share of the pixels that no planned exposure may saturate."""


@dataclass(frozen=True, slots=True, eq=False)
class SceneStatistics:
    """Typical pixels of a scene, P of them.

    Attributes
    ----------
    brightness_dn_per_s
        (P) zeroth moment b_0 in DN for each second of exposure.
    brightest_dn_per_s
        That of the brightest pixels that must not saturate.
    delay_s, share
        (K, P) returns: time of flight (NaN where unused) and share of the pixel's light (0 where
        unused). What the shares leave to 1 comes back evenly at all times.
    ambient_dn_per_s
        Light that is not the camera's, in DN an image for each second of exposure.
    harmonics
        Number of harmonics of the frame that shows it; None where the scene is given exactly.
    relative_noise
        Deviation of a typical pixel's moments over its brightness, in that frame.
    range_std_m
        Deviation of a typical pixel's range in that frame.
    """

    brightness_dn_per_s: _Array
    brightest_dn_per_s: float
    delay_s: _Array
    share: _Array
    ambient_dn_per_s: float = 0.0
    harmonics: int | None = None
    relative_noise: float = 0.0
    range_std_m: float = 0.0

    def direct_m(self, threshold: float) -> _Array:
        """Return the range (P) of the first return with a share of the strongest one's light."""
        counts = (self.share >= threshold * self.share.max(axis=0)) & (self.share > 0)
        first_s = np.where(counts, self.delay_s, np.inf).min(axis=0)
        return np.asarray(first_s * tm.SPEED_OF_LIGHT_M_S / 2)

    @property
    def furthest_m(self) -> float:
        """Range of the latest return."""
        return float(np.nanmax(self.delay_s)) * tm.SPEED_OF_LIGHT_M_S / 2

    def relative_moments(self, harmonics: int, base_frequency_hz: float) -> _Array:
        """Return moments (m + 1, P) of pixels with a brightness of 1."""
        j = np.arange(harmonics + 1)[:, None, None]
        phase = 2 * np.pi * base_frequency_hz * np.nan_to_num(self.delay_s)
        moments: _Array = (self.share * np.exp(1j * j * phase)).sum(axis=1)
        moments[0] = 1.0
        return moments


def uniform_scene(
    brightness_dn_per_s: float,
    returns: Iterable[tuple[float, float]],
    *,
    ambient_dn_per_s: float = 0.0,
) -> SceneStatistics:
    """Describe a scene of equal pixels.

    Parameters
    ----------
    brightness_dn_per_s
        b_0 in DN for each second of exposure.
    returns
        Range in m and relative weight of each.
    ambient_dn_per_s
        As in `SceneStatistics`.
    """
    range_m, weight = np.array(list(returns), dtype=float).T
    repeated = (len(range_m), PIXELS)
    delay_s = np.broadcast_to(2 * range_m[:, None] / tm.SPEED_OF_LIGHT_M_S, repeated)
    share = np.broadcast_to(weight[:, None] / weight.sum(), repeated)
    return SceneStatistics(
        np.full(PIXELS, brightness_dn_per_s),
        brightness_dn_per_s,
        delay_s,
        share,
        ambient_dn_per_s,
    )


def scene_of_frame(
    found: tm.Reconstruction,
    noise: tm.noise.MomentNoise,
    *,
    exposure_s: float,
    base_frequency_hz: float,
    ambient_dn_per_s: float = 0.0,
) -> SceneStatistics | None:
    """Describe the scene that a frame shows, as far as the frame resolves it.

    Parameters
    ----------
    found
        Of moments (m + 1, H, W).
    noise
        Of its smoothed moments, (m + 1, H, W).
    exposure_s, base_frequency_hz
        What the frame was captured with.
    ambient_dn_per_s
        As in `SceneStatistics`.

    Returns
    -------
    SceneStatistics or None
        None where no pixel has light.

    Notes
    -----
    The returns of Pisarenko's estimate are all of the frame's moments, also where they stand for
    continuous light and where they are made of noise: what they do to a sequence with no more
    harmonics and no less noise is what the scene does.
    """
    bad = int(tm.INVALID | tm.Flags.SATURATED)
    usable = ((np.asarray(found.flags) & bad) == 0).ravel()
    there = np.flatnonzero(usable)
    if not there.size:
        return None
    chosen = there[np.linspace(0, there.size - 1, PIXELS).astype(int)]
    brightness = np.maximum(np.asarray(found.smoothed[0].real, dtype=float), 0).ravel()
    m = found.returns.weight.shape[0]
    weight = np.asarray(found.returns.weight, dtype=float).reshape((m, -1))[:, chosen]
    phase = np.asarray(found.returns.phase_rad, dtype=float).reshape((m, -1))[:, chosen]
    variance = noise.variance.reshape((m + 1, -1))[:, chosen]
    total = np.maximum(brightness[chosen], weight.sum(axis=0))
    return SceneStatistics(
        total / exposure_s,
        float(np.quantile(brightness[there], BRIGHT_SHARE)) / exposure_s,
        np.where(weight > 0, phase / (2 * np.pi * base_frequency_hz), np.nan),
        weight / total,
        ambient_dn_per_s,
        m,
        float(np.median(np.sqrt(variance[1]) / total)),
        _range_std_m(found, phase, weight, tm.noise.MomentNoise(variance), base_frequency_hz),
    )


def _range_std_m(
    found: tm.Reconstruction,
    phase: _Array,
    weight: _Array,
    noise: tm.noise.MomentNoise,
    base_frequency_hz: float,
) -> float:
    returns = tm.Returns(phase, weight, np.zeros(phase.shape[1]), (weight > 0).sum(axis=0))
    deviation = tm.noise.return_noise(returns, noise, threshold=found.settings.threshold)
    std_rad = deviation.direct_phase_std_rad
    known = std_rad[np.isfinite(std_rad)]
    return float(tm.range_m(np.median(known), base_frequency_hz)) if known.size else 0.0
