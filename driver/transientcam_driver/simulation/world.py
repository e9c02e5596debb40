"""A scene in front of the simulated sensor: from impulse responses to images."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.handle import ExplainedEffect, Explanation, Truth
from transientcam_driver.sensor import Sensor
from transientcam_driver.sequence import ImageLabel, Sequence
from transientcam_driver.simulation.effects import CALLED_ABOVE, EFFECTS, Call, Conditions, Effect
from transientcam_driver.simulation.effects.effect import (
    Exposure,
    ImageEffect,
    LightEffect,
    LightPlanes,
    NormalDraw,
    PlaneEffect,
    Shot,
    ShotEffect,
    Stage,
)
from transientcam_driver.simulation.effects.modulation_harmonics import ModulationHarmonics
from transientcam_driver.simulation.effects.motion import MotionDuringSequence
from transientcam_driver.simulation.effects.thermal_drift import ThermalDrift
from transientcam_driver.simulation.imperfections import IDEAL, DeviceProfile
from transientcam_driver.simulation.light import Scenery, View, ViewAt

_AMBIENT_C = 25.0


@dataclass(frozen=True, slots=True)
class _Quadratures:
    """Electrons at phase theta: ``offset + sum_k re_k cos(k theta) + im_k sin(k theta)``."""

    constant: NDArray[np.float32] | np.float32
    offset: NDArray[np.float32]
    terms: tuple[tuple[int, NDArray[np.float32], NDArray[np.float32]], ...]

    @classmethod
    def of(cls, planes: LightPlanes) -> "_Quadratures":
        """Take planes apart into contiguous ones."""
        terms = tuple(
            (k, np.ascontiguousarray(term.real), np.ascontiguousarray(term.imag))
            for k, term in planes.terms.items()
        )
        return cls(planes.constant, planes.mean + planes.constant, terms)


@dataclass(slots=True)
class _Plan:
    """Everything that is the same for all images of a sequence.

    ``view`` is that of the last image, ``mean`` its brightness, and ``quadratures`` its planes by
    harmonic.
    """

    sequence: Sequence
    frequencies_hz: dict[int, float]
    conditions: Conditions
    view_at: ViewAt
    per_image: bool
    waveform: ModulationHarmonics | None
    on_light: tuple[PlaneEffect, ...]
    on_shot: tuple[ShotEffect, ...]
    stages: tuple[Stage, ...]
    view: View | None = None
    mean: NDArray[np.float64] | None = None
    quadratures: dict[int, _Quadratures] = field(default_factory=dict)


class World:
    """The renderer behind the simulated firmware.

    Parameters
    ----------
    scenery
        The light in front of the camera.
    sensor
        Turns electrons into numbers.
    electrons_per_s
        Electrons a second that a relative brightness of 1 gives a pixel.
    effects
        "auto", "on" or "off" by the effect's name.
    seed
        Of all randomness: the noise of an image depends on the seed and its sequence number only.
    device
        Imperfections of the camera.
    ambient_electrons_per_s
        Electrons a second that other light gives a pixel that sees a white surface.
    readout_s
        Time between two exposures.
    """

    def __init__(
        self,
        scenery: Scenery,
        sensor: Sensor,
        *,
        electrons_per_s: float,
        effects: Mapping[str, str],
        seed: int,
        device: DeviceProfile = IDEAL,
        ambient_electrons_per_s: float = 0.0,
        readout_s: float = 0.0,
    ) -> None:
        self._scenery = scenery
        self._sensor = sensor
        self._electrons_per_s = electrons_per_s
        self._effects = dict(effects)
        self._seed = seed
        self._device = device
        self._ambient_electrons_per_s = ambient_electrons_per_s
        self._readout_s = readout_s
        self._brightness = scenery.preview.responses.moments(0.0).real
        self._plan: _Plan | None = None

    @property
    def sensor(self) -> Sensor:
        """Its sensor."""
        return self._sensor

    def configure(self, sequence: Sequence, labels: tuple[ImageLabel, ...]) -> None:
        """Build the effects that the sequence calls for."""
        sequence = replace(sequence, phase_offset_rad=0.0)  # which the labels have in them
        if self._plan is not None and self._plan.sequence == sequence:
            return
        conditions = self.conditions(sequence)
        built = [effect for effect in EFFECTS if self._is_built(effect, conditions)]
        of_light = frozenset(each.name for each in built if issubclass(each, LightEffect))
        made = [effect(self._forced(effect, conditions)) for effect in built]
        self._plan = _Plan(
            sequence,
            {label.harmonic: label.frequency_hz for label in labels},
            conditions,
            self._scenery.view(of_light),
            MotionDuringSequence.name in of_light,
            next((each for each in made if isinstance(each, ModulationHarmonics)), None),
            tuple(each for each in made if isinstance(each, PlaneEffect)),
            tuple(each for each in made if isinstance(each, ShotEffect)),
            _stages([each for each in made if isinstance(each, ImageEffect)]),
        )
        if not self._scenery.moves:  # all at once, rather than during the first exposures
            for harmonic in self._plan.frequencies_hz:
                self._quadratures(self._plan, harmonic, 0.0)

    def image(self, label: ImageLabel, *, number: int, device_time_s: float) -> NDArray[np.uint16]:
        """Expose and read one image: 1/2 (b_0 + Re(b_j G_1 exp(-i theta))), then the effects."""
        plan = self._configured()
        shot = Shot(number, device_time_s, self._seed)
        for effect in plan.on_shot:
            effect.on_shot(shot)
        random = np.random.Generator(np.random.SFC64(np.random.SeedSequence((self._seed, number))))
        exposure = Exposure(self._mean_e(plan, label, shot), random)
        for stage in plan.stages:
            stage.apply(exposure)
        return exposure.signal.astype(np.uint16)

    def temperature_c(self, device_time_s: float) -> float:
        """Temperature of the sensor, which rises where thermal drift is built."""
        effects = self._plan.on_shot if self._plan is not None else ()
        rises_c = [each.rise_c(device_time_s) for each in effects if isinstance(each, ThermalDrift)]
        return _AMBIENT_C + sum(rises_c)

    def conditions(self, sequence: Sequence) -> Conditions:
        """Conditions by which effects are judged."""
        scale_e = self._electrons_per_s * sequence.exposure_s
        lit = self._brightness[self._brightness > 0]
        white_e = self._ambient_electrons_per_s * sequence.exposure_s
        return Conditions(
            sensor=self._sensor,
            sequence=sequence,
            brightness_e=float(lit.mean()) * scale_e if lit.size else 0.0,
            pixels=self._brightness.size,
            brightest_e=float(self._brightness.max(initial=0.0)) * scale_e,
            ambient_white_e=white_e,
            ambient_e=white_e * float(np.mean(self._scenery.preview.reflectance)),
            image_period_s=sequence.exposure_s + self._readout_s,
            device=self._device,
            facts=self._scenery.facts,
            shape=(self._brightness.shape[0], self._brightness.shape[1]),
        )

    def calls(self, sequence: Sequence) -> dict[str, Call]:
        """Judge each effect for this scene and a sequence."""
        conditions = self.conditions(sequence)
        return {
            effect.name: effect.called_for(self._forced(effect, conditions)) for effect in EFFECTS
        }

    def explain(self, scene: str, sequence: Sequence | None = None) -> Explanation:
        """Explain what a sequence calls for, by default the one that is set."""
        if sequence is None:
            sequence = self._configured().sequence
        floor_dn = self.conditions(sequence).floor_dn
        effects = []
        for effect, call in zip(EFFECTS, self.calls(sequence).values(), strict=True):
            choice = self.choice(effect)
            explained = ExplainedEffect(
                effect=effect.name,
                choice=choice if effect.optional else "always",
                called_for=bool(call.called),
                built=choice == "on" or (choice == "auto" and bool(call.called)),
                reason=call.reason,
                size_dn=float(call.size_dn),
                relative=float(call.size_dn) / floor_dn,
                cost_s=call.cost_s * sequence.images,
            )
            effects.append(explained)
        return Explanation(
            scene, self._device.name, sequence, floor_dn, tuple(effects), CALLED_ABOVE
        )

    def choice(self, effect: type[Effect]) -> str:
        """Return "auto", "on" or "off"."""
        return self._effects.get(effect.name, "auto") if effect.optional else "auto"

    def truth(self, *, device_time_s: float | None = None) -> Truth:
        """Ground truth, in DN at the exposure set; of the image that was made last."""
        plan = self._configured()
        if device_time_s is not None or plan.view is None:
            view = plan.view_at(device_time_s or 0.0)
        else:
            view = plan.view
        responses = view.responses
        scale_dn = self._electrons_per_s * plan.sequence.exposure_s / self._sensor.gain_e_per_dn
        delay_s, weight = responses.returns()
        return Truth(delay_s, weight * scale_dn, responses.kind, responses.of_pixel, scale_dn)

    def _mean_e(self, plan: _Plan, label: ImageLabel, shot: Shot) -> NDArray[np.float32]:
        time_s = shot.device_time_s
        if not plan.per_image:
            time_s -= label.index * plan.conditions.image_period_s
        light = self._quadratures(plan, label.harmonic, time_s)
        if not label.illumination:
            return np.zeros_like(light.offset) + light.constant
        electrons = light.offset.copy()
        turn_rad = label.phase_rad - 2 * np.pi * label.frequency_hz * shot.delay_s
        for k, in_phase, quadrature in light.terms:
            # the phasor of theta, turned back by light that is late or out of step
            phasor = np.exp(1j * k * turn_rad)
            if shot.factor != 1.0:
                phasor *= np.conj(shot.factor)
            electrons += in_phase * np.float32(phasor.real)
            electrons += quadrature * np.float32(phasor.imag)
        # |b_j| <= b_0, except for rounding
        np.maximum(electrons, np.float32(0), out=electrons)
        return electrons

    def _quadratures(self, plan: _Plan, harmonic: int, time_s: float) -> _Quadratures:
        """Planes of the images of a harmonic; computed again only where the scene moves."""
        view = plan.view_at(time_s)
        if plan.view is not view:
            plan.view = view
            plan.mean = view.responses.moments(0.0).real
            plan.quadratures.clear()
        assert plan.mean is not None  # noqa: S101  (set with view)
        if harmonic not in plan.quadratures:
            frequency_hz = plan.frequencies_hz[harmonic]
            plan.quadratures[harmonic] = _Quadratures.of(
                self._planes(plan, frequency_hz, view, plan.mean)
            )
        return plan.quadratures[harmonic]

    def _planes(
        self, plan: _Plan, frequency_hz: float, view: View, mean: NDArray[np.float64]
    ) -> LightPlanes:
        scale_e = 0.5 * self._electrons_per_s * plan.sequence.exposure_s
        planes = LightPlanes(
            frequency_hz,
            np.float32(0),
            view.reflectance,
            (scale_e * mean).astype(np.float32),
        )
        if frequency_hz:
            contents = plan.waveform.harmonics(frequency_hz) if plan.waveform else {1: 1.0}
            for k, content in contents.items():
                factor = scale_e * content * plan.conditions.sub_phase_gain(k)
                moments = view.responses.moments(k * frequency_hz)
                planes.terms[k] = (factor * moments).astype(np.complex64)
        for effect in plan.on_light:
            effect.on_light(planes)
        return planes

    def _is_built(self, effect: type[Effect], conditions: Conditions) -> bool:
        choice = self.choice(effect)
        if choice == "auto":
            return effect.called_for(conditions).called
        return choice == "on"

    def _forced(self, effect: type[Effect], conditions: Conditions) -> Conditions:
        """Conditions of a device that has the imperfection of an effect that is forced on."""
        if self.choice(effect) != "on":
            return conditions
        return effect.forced_on(conditions)

    def _configured(self) -> _Plan:
        assert self._plan is not None, "no sequence committed"  # noqa: S101  (the firmware configures first)
        return self._plan


def _stages(effects: list[ImageEffect]) -> tuple[Stage, ...]:
    """Insert one draw of noise behind the stages that add to its variance."""
    stages: list[Stage] = []
    for effect in effects:
        if stages and stages[-1].adds_variance and not effect.adds_variance:
            stages.append(NormalDraw())
        stages.append(effect)
    return tuple(stages)
