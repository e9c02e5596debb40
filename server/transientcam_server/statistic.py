"""What a scene is to a prediction: how bright its pixels are, and what light they send back."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import transientcam_moments as tm
from numpy.typing import NDArray

_Array = NDArray[Any]
PIXELS: Final = 256
"""How many pixels stand for a scene."""
BRIGHT_SHARE: Final = 0.99
"""Share of the pixels that no planned exposure may saturate."""
_SIGNIFICANT: Final = 3.0
"""Standard deviations from which a return of a measured frame counts as there."""


@dataclass(frozen=True, slots=True, eq=False)
class SceneStatistic:
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
    """

    brightness_dn_per_s: _Array
    brightest_dn_per_s: float
    delay_s: _Array
    share: _Array
    ambient_dn_per_s: float = 0.0

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


def given(
    brightness_dn_per_s: float,
    returns: Iterable[tuple[float, float]],
    *,
    ambient_dn_per_s: float = 0.0,
) -> SceneStatistic:
    """Describe a scene of equal pixels.

    Parameters
    ----------
    brightness_dn_per_s
        b_0 in DN for each second of exposure.
    returns
        Range in m and relative weight of each.
    ambient_dn_per_s
        As in `SceneStatistic`.
    """
    range_m, weight = np.array(list(returns), dtype=float).T
    repeated = (len(range_m), PIXELS)
    delay_s = np.broadcast_to(2 * range_m[:, None] / tm.SPEED_OF_LIGHT_M_S, repeated)
    share = np.broadcast_to(weight[:, None] / weight.sum(), repeated)
    return SceneStatistic(
        np.full(PIXELS, brightness_dn_per_s),
        brightness_dn_per_s,
        delay_s,
        share,
        ambient_dn_per_s,
    )


def of_frame(
    found: tm.Reconstruction,
    noise_of: tm.noise.MomentNoise,
    *,
    exposure_s: float,
    base_frequency_hz: float,
    ambient_dn_per_s: float = 0.0,
) -> SceneStatistic | None:
    """Describe the scene that a frame shows, as far as the frame resolves it.

    Parameters
    ----------
    found
        Of moments (m + 1, H, W).
    noise_of
        Noise of its smoothed moments, (m + 1, H, W).
    exposure_s, base_frequency_hz
        What the frame was captured with.
    ambient_dn_per_s
        As in `SceneStatistic`.

    Returns
    -------
    SceneStatistic or None
        None where no pixel has light.

    Notes
    -----
    Returns count that are strong enough to be the direct one and clearly above the noise; the rest
    of what Pisarenko's estimate finds is mostly made of noise, and counts as light at all times.
    """
    bad = int(tm.INVALID | tm.Flags.SATURATED)
    usable = ((np.asarray(found.flags) & bad) == 0).ravel()
    there = np.flatnonzero(usable)
    if not there.size:
        return None
    chosen = there[np.linspace(0, there.size - 1, PIXELS).astype(int)]
    brightness = np.maximum(np.asarray(found.smoothed[0].real, dtype=float), 0).ravel()
    returns = tm.Returns(*(np.asarray(part) for part in found.returns))
    m = returns.weight.shape[0]
    weight = returns.weight.reshape((m, -1))[:, chosen].astype(float)
    phase = returns.phase_rad.reshape((m, -1))[:, chosen].astype(float)
    variance = noise_of.variance.reshape((m + 1, -1))[:, chosen]
    with np.errstate(all="ignore"):
        bound = tm.noise.cramer_rao(phase, weight, tm.noise.MomentNoise(variance))
        strong = weight >= found.settings.threshold * weight.max(axis=0)
        clear = weight > _SIGNIFICANT * bound.weight_std
        # the strongest is there in any case
        counts = (strong & clear) | ((weight == weight.max(axis=0)) & (weight > 0))
    total = np.maximum(brightness[chosen], weight.sum(axis=0))
    return SceneStatistic(
        total / exposure_s,
        float(np.quantile(brightness[there], BRIGHT_SHARE)) / exposure_s,
        np.where(counts, phase / (2 * np.pi * base_frequency_hz), np.nan),
        np.where(counts, weight / total, 0.0),
        ambient_dn_per_s,
    )
