"""The handle on a simulated camera: what it offers beside frames, and the values it returns.

It stands below the camera and the simulation, so that neither the camera nor those that use it
import the simulation.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera._factory import Lens
from transientcam_driver.camera._sensor import Sensor
from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S, Sequence

Response = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Times in s, and at each a weight (sparse) or a density per s (dense)."""


@dataclass(frozen=True)
class SurfaceSeen:
    """The surface that a ray through each pixel's centre meets first.

    ``range_m`` (H, W) is half the way lamp - surface - camera, lit or not, and a mirror's own in a
    mirror; NaN where the ray meets nothing, the back of a surface, or a stencil's mask.
    ``direct_share`` (H, W) of the pixel's light came that way: 0 in shadow and in a mirror.
    """

    range_m: NDArray[np.float64]
    direct_share: NDArray[np.float64]


@dataclass(frozen=True)
class Truth:
    """The ground truth of a scene, in the units of what is measured.

    Attributes
    ----------
    delay_s
        (K, H, W) of each return, by delay; NaN where there is none.
    weight
        (K, H, W) in DN at the exposure set; 0 where there is none.
    kind
        "sparse": the returns are all there is. "dense": they sum up continuous responses, each
        by its first peak and its mass.
    surface
        What the pixels see; None of responses from files.
    """

    delay_s: NDArray[np.float64]
    weight: NDArray[np.float64]
    kind: Literal["sparse", "dense"]
    _of_pixel: Callable[[int, int], Response]
    _scale_dn: float
    surface: SurfaceSeen | None = None

    @property
    def range_m(self) -> NDArray[np.float64]:
        """(H, W): of the surface seen, lit or not; of responses from files the first return's."""
        return self.first_return_m if self.surface is None else self.surface.range_m

    @property
    def first_return_m(self) -> NDArray[np.float64]:
        """(H, W): half the way of the first light, whatever its way; NaN where none comes back."""
        range_m: NDArray[np.float64] = SPEED_OF_LIGHT_M_S * self.delay_s[0] / 2
        return range_m

    @property
    def direct_share(self) -> NDArray[np.float64]:
        """(H, W): of the light, what came straight by that surface; NaN if unknown."""
        if self.surface is None:
            return np.full(self.delay_s.shape[1:], np.nan)
        return self.surface.direct_share

    @property
    def lit(self) -> NDArray[np.bool_]:
        """(H, W): where the surface has direct light; of responses from files, any light."""
        lit = np.isfinite(self.range_m) & (self.brightness > 0)
        return lit if self.surface is None else lit & (self.surface.direct_share > 0)

    @property
    def direct(self) -> NDArray[np.float64]:
        """(H, W): weight of the first return, in DN."""
        direct: NDArray[np.float64] = self.weight[0]
        return direct

    @property
    def brightness(self) -> NDArray[np.float64]:
        """(H, W): all light that comes back, in DN."""
        total: NDArray[np.float64] = self.weight.sum(axis=0)
        return total

    def impulse_response(self, x: int, y: int) -> Response:
        """Return a pixel's times in s, with weights in DN (sparse) or a density in DN/s (dense)."""
        time_s, value = self._of_pixel(x, y)
        return time_s, value * self._scale_dn


@dataclass(frozen=True, slots=True)
class ExplainedEffect:
    """What one effect makes of a scene and a sequence.

    ``what``: the effect in a few words.
    ``choice``: "auto", "on" or "off"; "always" where there is no choice, "never" of what cannot be
    made.
    ``called_for``, ``built``: whether the conditions call for the effect, and whether the choice
    lets it be built.
    ``size_dn``, ``relative``: the error it causes in one moment, as a root mean square over the lit
    pixels, and the same of the errors over each pixel's own noise, at the worst of the times
    judged.
    ``worst``: the largest such ratio of any pixel judged.
    ``cost_s``: of one frame, by the order of magnitude; what is computed once a sequence costs
    nothing.
    """

    effect: str
    what: str
    choice: str
    called_for: bool
    built: bool
    reason: str
    size_dn: float
    relative: float
    worst: float
    cost_s: float

    def to_document(self) -> dict[str, Any]:
        """Return it as a JSON document."""
        return {name: getattr(self, name) for name in self.__slots__}


@dataclass(frozen=True, slots=True)
class Explanation:
    """What all effects make of a scene and a sequence.

    ``floor_dn`` is the noise floor of one moment of a typical pixel: shot noise, read noise and
    rounding, averaged over the takes. An effect is called for above ``threshold`` of the noise as a
    root mean square, or above ``threshold_of_worst`` of its noise in any pixel. ``not_made`` is
    light that the scene has and the simulation cannot make; where it is called for, images lack it.
    ``device`` names the profile, and what of the device differs from it.
    """

    scene: str
    device: str
    sequence: Sequence
    floor_dn: float
    effects: tuple[ExplainedEffect, ...]
    not_made: tuple[ExplainedEffect, ...]
    threshold: float
    threshold_of_worst: float

    def to_document(self) -> dict[str, Any]:
        """Return it as a JSON document."""
        return {
            "scene": self.scene,
            "device": self.device,
            "sequence": self.sequence.to_document(),
            "noise_floor_dn": self.floor_dn,
            "called_above": self.threshold,
            "called_above_worst": self.threshold_of_worst,
            "effects": [each.to_document() for each in self.effects],
            "not_made": [each.to_document() for each in self.not_made],
        }


class Simulation(Protocol):
    """What only a simulated camera offers: its scene, its effects, its truth, and its faults."""

    @property
    def scene(self) -> str:
        """Name of the scene."""
        ...

    @property
    def definition(self) -> str | None:
        """Text of the scene's file where `change` was given it; None for one with a name."""
        ...

    def lens(self, *, width: int, height: int) -> Lens | None:
        """Return what images are taken through, and their light; None without a place."""
        ...

    @property
    def effects(self) -> dict[str, str]:
        """Choices of effects, "auto", "on" or "off", that `change` made in place of the scene's."""
        ...

    @property
    def diffuser(self) -> bool:
        """Whether filter and diffuser are before the lens."""
        ...

    def change(
        self,
        *,
        scene: str | None = None,
        definition: str | None = None,
        effects: Mapping[str, str] | None = None,
        diffuser: bool | None = None,
        ask: Callable[[], object] = lambda: None,
    ) -> None:
        """Put the camera in front of another scene, or choose other effects; images go on.

        Returns once the scene is prepared, which may take seconds. The camera stays the same
        unit: its sensor and its imperfections are those of the scene it was built with. The
        frame that is captured meanwhile may hold images of both.

        Parameters
        ----------
        scene
            Name of a built-in scene, a path to a scene's .toml, or the scene it was built with;
            the present one by default.
        definition
            In its place the text of a scene file, which may name no other file and cost no more
            than the limits of `transientcam_simulation.scene` state.
        effects
            "auto", "on" or "off" by an effect's name, in place of all earlier choices; by default
            these stay.
        diffuser
            Puts filter and diffuser before the lens, so that the light shines at the sensor as in
            a calibration (Sec. 4.2), or takes them away; by default they stay.
        ask
            Called between the steps, from this thread; what it raises gives the change up.

        Raises
        ------
        SceneError
            There is no such scene, or its file is not valid.
        EffectError
            There is no such effect or choice.
        """

    def truth(self, *, device_time_s: float | None = None) -> Truth:
        """Ground truth of the scene at the exposure set: of the last image, or at a time."""
        ...

    def explain(self, sequence: Sequence | None = None) -> Explanation:
        """Explain what each effect makes of the scene and a sequence, by default the one set."""
        ...

    @property
    def sensor(self) -> Sensor:
        """Its sensor, with the figures of a data sheet."""
        ...

    @property
    def plugged(self) -> bool:
        """Whether the cable is in."""
        ...

    def unplug(self) -> None:
        """Pull the cable; the camera raises CameraLost."""

    def replug(self) -> None:
        """Plug the cable in again; ``Camera.reconnect`` finds the camera."""

    def corrupt_next(self, images: int = 1) -> None:
        """Damage the pixels of the next images on the wire."""

    def drop_next(self, images: int = 1) -> None:
        """Lose the next images on the wire."""

    def set_interlock(self, *, closed: bool) -> None:
        """Open or close the safety interlock of the light."""
