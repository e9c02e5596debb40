"""Effects of the lens: it bends, darkens and scatters light."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.base import TYPICAL_LENS
from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import LightEffect, LightPlanes, PlaneEffect

_SCATTER_COST_S_PER_PIXEL = 2e-7  # only where the scene moves; else it is done once


class Distortion(LightEffect):
    """Bends the camera's rays; costs nothing once the scene is traced."""

    name = "distortion"
    what = "straight lines bend in the lens"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the lens bends rays to other light."""
        if not conditions.lens.bends:
            return Call(False, "the lens shows straight lines straight", 0.0, 0.0)
        k1 = conditions.lens.distortion[0]
        reason = f"radial distortion k1 = {k1:g} and an axis off the middle by "
        reason += f"({conditions.lens.centre[0]:g}, {conditions.lens.centre[1]:g})"
        changes = conditions.changes(cls.name)
        return weigh(conditions, changes, reason) if changes else Call(False, reason, 0.0, 0.0)

    @classmethod
    def forced_on(cls, conditions: Conditions) -> Conditions:
        """Return conditions with a typical lens, where the scene's is a pinhole."""
        if conditions.lens.bends:
            return conditions
        lens = replace(conditions.lens, distortion=TYPICAL_LENS.distortion)
        return replace(conditions, lens=lens)


class Vignetting(PlaneEffect):
    """Light falls with a power of the cosine to the lens's axis; the fourth is a thin lens's."""

    name = "vignetting"
    what = "the lens is darker towards the corners"

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self._share = (conditions.cosine**conditions.lens.vignetting).astype(np.float32)

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the lens darkens pixels that light reaches."""
        power = conditions.lens.vignetting
        if not power:
            return Call(False, "the lens passes the same light everywhere", 0.0, 0.0)
        changes = tuple((1 - each.cosine**power) * each.brightness for each in conditions.glimpses)
        least = min(float(each.cosine.min()) for each in conditions.glimpses) ** power
        return weigh(conditions, changes, f"down to {least:.0%} of the light in the corners")

    @classmethod
    def forced_on(cls, conditions: Conditions) -> Conditions:
        """Return conditions with a thin lens, where the scene's passes light evenly."""
        if conditions.lens.vignetting:
            return conditions
        lens = replace(conditions.lens, vignetting=TYPICAL_LENS.vignetting)
        return replace(conditions, lens=lens)

    def on_light(self, planes: LightPlanes) -> None:
        """Darken all light."""
        share = self._share[planes.region] if self._share.ndim else self._share
        planes.constant = planes.constant * share
        planes.mean = planes.mean * share
        for k, term in planes.terms.items():
            planes.terms[k] = term * share


class LensScatter(PlaneEffect):
    """A share of the light is spread by a wide Gaussian; light that leaves the image is lost."""

    name = "lens-scatter"
    what = "light goes astray in the lens"
    figures = "lens_scatter"
    local = False

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        height, width = conditions.shape
        self._share = self._figures.share
        sigma = self._figures.width * width
        self._rows, self._columns = _spread(height, sigma), _spread(width, sigma)

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the lens scatters more than a trace of light."""
        scatter = conditions.device.lens_scatter
        if scatter is None or not scatter.share:
            return Call(False, "the lens of the device is clear", 0.0, 0.0)
        cost_s = conditions.pixels * _SCATTER_COST_S_PER_PIXEL if conditions.moves else 0.0
        reason = f"{scatter.share:.1%} of the light goes astray"
        changes = []
        for each in conditions.glimpses:
            plane = each.brightness.reshape(each.shape)
            rows, columns = (_spread(n, scatter.width * each.shape[1]) for n in each.shape)
            # light that comes from elsewhere may have any phase
            astray = rows @ plane @ columns.T + plane
            changes.append(scatter.share * astray.ravel())
        return weigh(conditions, tuple(changes), reason, cost_s)

    def on_light(self, planes: LightPlanes) -> None:
        """Spread all light."""
        planes.mean = self._spread(planes.mean).astype(np.float32)
        if np.ndim(planes.constant):
            planes.constant = self._spread(np.asarray(planes.constant)).astype(np.float32)
        for k, term in planes.terms.items():
            planes.terms[k] = self._spread(term).astype(np.complex64)

    def _spread(self, plane: NDArray[np.inexact]) -> NDArray[np.inexact]:
        astray = self._rows @ plane @ self._columns.T
        spread: NDArray[np.inexact] = (1 - self._share) * plane + self._share * astray
        return spread


def _spread(count: int, sigma: float) -> NDArray[np.float32]:
    """Matrix (count, count) whose columns spread a pixel's light; some falls beyond the edges."""
    pixels = np.arange(count)
    reach = np.arange(-4 * count, 5 * count)
    density = np.exp(-0.5 * ((pixels[:, None] - pixels[None, :]) / sigma) ** 2)
    # normalised over all places, not only those on the sensor
    spread = density / np.exp(-0.5 * (reach / sigma) ** 2).sum()
    return np.asarray(spread, dtype=np.float32)
