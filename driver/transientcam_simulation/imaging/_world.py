"""A scene in front of the simulated sensor: from impulse responses to images."""

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import ExplainedEffect, Explanation, Sensor, Truth
from transientcam_driver.sequence import ImageLabel, Sequence
from transientcam_simulation.base import (
    IDEAL,
    PINHOLE,
    STEADY,
    DeviceProfile,
    Lens,
    OtherLight,
    ask,
)
from transientcam_simulation.effects import (
    CALLED_ABOVE,
    EFFECTS,
    WORST_ABOVE,
    Call,
    Conditions,
    Distortion,
    Effect,
    Exposure,
    ImageEffect,
    LightEffect,
    LightPlanes,
    Missing,
    ModulationHarmonics,
    MotionBlur,
    MotionDuringSequence,
    PlaneEffect,
    Shot,
    ShotEffect,
    ThermalDrift,
    missing_calls,
)
from transientcam_simulation.imaging._quadratures import Canvas, Quadratures
from transientcam_simulation.imaging._readout import ReadOut
from transientcam_simulation.light import LightRequirements, Region, Scenery, View, Views

_AMBIENT_C = 25.0


@dataclass(slots=True)
class _Plan:
    """Everything that is the same for all images of a sequence.

    ``instants``: of an exposure that an image is the mean over.
    ``trace`` returns ``views``, which may take seconds. ``time_s`` is that of the last image.
    ``quadratures`` are planes of ``view`` by harmonic, and ``canvases`` such planes over a
    background.
    """

    sequence: Sequence
    frequencies_hz: dict[int, float]
    conditions: Conditions
    trace: Callable[[], Views]
    lens: Lens
    per_image: bool
    instants: int
    waveform: ModulationHarmonics | None
    on_light: tuple[PlaneEffect, ...]
    on_shot: tuple[ShotEffect, ...]
    read_out: ReadOut
    view: View | None = None
    time_s: float = 0.0
    quadratures: dict[int, Quadratures] = field(default_factory=dict)
    canvases: dict[int, Canvas] = field(default_factory=dict)
    traced: Views | None = None

    @property
    def views(self) -> Views:
        """What pixels see, traced when it is first needed."""
        if self.traced is None:
            self.traced = self.trace()
        return self.traced

    @property
    def local(self) -> bool:
        """Whether a region of the planes can be computed by itself."""
        return all(effect.local for effect in self.on_light)


class World:
    """The renderer behind the simulated firmware.

    ``scenery``: the light in front of the camera.
    ``sensor``: turns electrons into numbers.
    ``electrons_per_s``: electrons a second that a relative brightness of 1 gives a pixel.
    ``effects``: "auto", "on" or "off" by the effect's name.
    ``seed``: of all randomness: the noise of an image depends on the seed and its sequence number
    only.
    ``device``: imperfections of the camera.
    ``ambient_electrons_per_s``: electrons a second that other light gives a pixel that sees a white
    surface, and ``other_light`` how it changes.
    ``readout_s``: time between two exposures.
    """

    taps = 1
    """How many images with successive numbers show one exposure."""

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
        other_light: OtherLight = STEADY,
        readout_s: float = 0.0,
    ) -> None:
        self._scenery = scenery
        self._sensor = sensor
        self._electrons_per_s = electrons_per_s
        self._effects = dict(effects)
        self._seed = seed
        self._device = device
        self._ambient_electrons_per_s = ambient_electrons_per_s
        self._other_light = other_light
        self._readout_s = readout_s
        self._plan: _Plan | None = None

    @property
    def sensor(self) -> Sensor:
        """Its sensor."""
        return self._sensor

    @property
    def lens(self) -> Lens:
        """The lens that images are taken through; the scene's until a sequence is configured."""
        return self._scenery.lens if self._plan is None else self._plan.lens

    def configure(self, sequence: Sequence, labels: tuple[ImageLabel, ...]) -> None:
        """Build the effects that the sequence calls for; `prepare` traces their light."""
        sequence = replace(sequence, phase_offset_rad=0.0)  # which the labels have in them
        if self._plan is not None and self._plan.sequence == sequence:
            return
        conditions = self.conditions(sequence)
        built = [effect for effect in EFFECTS if self._is_built(effect, conditions)]
        of_light = frozenset(each.name for each in built if issubclass(each, LightEffect))
        made = [effect(self._forced(effect, conditions)) for effect in built]
        lens = next((self._forced(e, conditions).lens for e in built if e is Distortion), PINHOLE)
        noise = replace(conditions.noise, white_e=conditions.white_e)
        blurs = MotionBlur.name in of_light and self._scenery.moves
        self._plan = _Plan(
            sequence,
            {label.harmonic: label.frequency_hz for label in labels},
            conditions,
            partial(
                self._scenery.view,
                LightRequirements(
                    of_light, noise, conditions.highest_hz, lens, conditions.image_period_s
                ),
            ),
            lens,
            MotionDuringSequence.name in of_light,
            MotionBlur.instants if blurs else 1,
            next((each for each in made if isinstance(each, ModulationHarmonics)), None),
            tuple(each for each in made if isinstance(each, PlaneEffect)),
            tuple(each for each in made if isinstance(each, ShotEffect)),
            ReadOut([each for each in made if isinstance(each, ImageEffect)]),
        )

    def prepare(self) -> None:
        """Compute all at once that images need, rather than during the first exposures."""
        plan = self._configured()
        if plan.views and not self._scenery.moves:
            for harmonic in plan.frequencies_hz:
                self._quadratures(plan, harmonic, 0.0)

    def image(self, label: ImageLabel, *, number: int, device_time_s: float) -> NDArray[np.uint16]:
        """Expose and read one image: 1/2 (b_0 + Re(b_j G_1 exp(-i theta))), then the effects."""
        random = np.random.Generator(np.random.SFC64(np.random.SeedSequence((self._seed, number))))
        mean_e = self.mean_image_e(label, number=number, device_time_s=device_time_s)
        return self._configured().read_out.codes(Exposure(mean_e, random))

    def mean_image_e(
        self, label: ImageLabel, *, number: int, device_time_s: float
    ) -> NDArray[np.float32]:
        """Electrons (H, W) of an image on average, before noise and the converter."""
        plan = self._configured()
        exposure = (number + self.taps - 1) // self.taps
        shot = Shot(number, device_time_s, self._seed, exposure, label)
        for effect in plan.on_shot:
            effect.on_shot(shot)
        return self._mean_e(plan, label, shot)

    def temperature_c(self, device_time_s: float) -> float:
        """Temperature of the sensor, which rises where thermal drift is built."""
        effects = self._plan.on_shot if self._plan is not None else ()
        rises_c = [each.rise_c(device_time_s) for each in effects if isinstance(each, ThermalDrift)]
        return _AMBIENT_C + sum(rises_c)

    def conditions(self, sequence: Sequence) -> Conditions:
        """Conditions by which effects are judged."""
        scale_e = self._electrons_per_s * sequence.exposure_s
        return Conditions(
            sensor=self._sensor,
            sequence=sequence,
            scale_e=scale_e,
            glimpses=self._scenery.glimpses,
            white_e=self._ambient_electrons_per_s * sequence.exposure_s,
            other_light=self._other_light,
            image_period_s=sequence.exposure_s + self._readout_s,
            device=self._device,
            lens=self._scenery.lens,
            facts=self._scenery.facts,
            cosine=self._scenery.cosine,
            moves=self._scenery.moves,
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
        conditions = self.conditions(sequence)
        made = []
        for effect, call in zip(EFFECTS, self.calls(sequence).values(), strict=True):
            choice = self.choice(effect)
            built = choice == "on" or (choice == "auto" and bool(call.called))
            shown = choice if effect.optional else "always"
            made.append(_explained(effect, call, shown, built, call.cost_s * sequence.images))
        not_made = (
            _explained(kind, call, "never", False, 0.0) for kind, call in missing_calls(conditions)
        )
        forced = conditions
        for effect in EFFECTS:
            forced = self._forced(effect, forced)
        return Explanation(
            scene,
            forced.device.described(forced.lens),
            sequence,
            conditions.floor_dn,
            tuple(made),
            tuple(not_made),
            CALLED_ABOVE,
            WORST_ABOVE,
        )

    def choice(self, effect: type[Effect]) -> str:
        """Return "auto", "on" or "off"."""
        return self._effects.get(effect.name, "auto") if effect.optional else "auto"

    def truth(self, *, device_time_s: float | None = None) -> Truth:
        """Ground truth, in DN at the exposure set; of the image that was made last."""
        plan = self._configured()
        time_s = plan.time_s if device_time_s is None else device_time_s
        responses, surface = plan.views.exact(time_s), plan.views.surface
        scale_dn = self._electrons_per_s * plan.sequence.exposure_s / self._sensor.gain_e_per_dn
        delay_s, weight = responses.returns()
        weight = weight * scale_dn
        seen = None if surface is None else surface(time_s)
        return Truth(delay_s, weight, responses.kind, responses.of_pixel, scale_dn, seen)

    def _mean_e(self, plan: _Plan, label: ImageLabel, shot: Shot) -> NDArray[np.float32]:
        time_s = shot.device_time_s
        if not plan.per_image:
            time_s -= label.index * plan.conditions.image_period_s
        turn_rad = label.phase_rad - 2 * np.pi * label.frequency_hz * shot.delay_s
        # the phasor of theta, turned back by light that is late or out of step
        out_of_step = np.conj(complex(shot.factor))
        seen: list[NDArray[np.float32]] = []
        for instant in range(plan.instants):
            at_s = time_s + (instant + 0.5) / plan.instants * plan.sequence.exposure_s
            light = self._quadratures(plan, label.harmonic, at_s)
            phasors = {k: complex(np.exp(1j * k * turn_rad)) * out_of_step for k, *_ in light.terms}
            seen.append(light.of_shot(phasors, shot))
        plan.time_s = time_s + 0.5 * plan.sequence.exposure_s
        return seen[0] if len(seen) == 1 else np.array(seen).mean(axis=0)

    def _quadratures(self, plan: _Plan, harmonic: int, time_s: float) -> Quadratures:
        """Planes of the images of a harmonic; computed again only where the scene moves."""
        ask()
        view = plan.views.at(time_s)
        frequency_hz = plan.frequencies_hz[harmonic]

        def of(view: View, region: Region | None) -> Quadratures:
            return Quadratures.of(self._planes(plan, frequency_hz, view, region))

        background = view.background
        if background is not None and view.region is not None and plan.local:
            canvas = plan.canvases.get(harmonic)
            if canvas is None or canvas.background is not background:
                canvas = plan.canvases[harmonic] = Canvas(background, of)
            return canvas.showing(view)
        if plan.view is not view:
            plan.view = view
            plan.quadratures.clear()
        if harmonic not in plan.quadratures:
            plan.quadratures[harmonic] = of(view, None).copy()
        return plan.quadratures[harmonic]

    def _planes(
        self, plan: _Plan, frequency_hz: float, view: View, region: Region | None
    ) -> LightPlanes:
        scale_e = 0.5 * self._electrons_per_s * plan.sequence.exposure_s
        planes = LightPlanes(
            frequency_hz,
            (slice(None), slice(None)) if region is None else region,
            np.float32(0),
            view.reflectance,
            (scale_e * view.moments(0.0, region).real).astype(np.float32, copy=False),
        )
        if frequency_hz:
            contents = plan.waveform.harmonics(frequency_hz) if plan.waveform else {1: 1.0}
            for k, content in contents.items():
                factor = scale_e * content * plan.conditions.sub_phase_gain(k)
                moments = view.moments(k * frequency_hz, region)
                planes.terms[k] = (factor * moments).astype(np.complex64, copy=False)
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


def _explained(
    kind: type[Effect] | Missing, call: Call, choice: str, built: bool, cost_s: float
) -> ExplainedEffect:
    return ExplainedEffect(
        effect=kind.name,
        what=kind.what,
        choice=choice,
        called_for=bool(call.called),
        built=built,
        reason=call.reason,
        size_dn=float(call.size_dn),
        relative=float(call.relative),
        worst=float(call.worst),
        cost_s=cost_s,
    )


class SwitchableWorld:
    """A renderer whose world can be exchanged at any time.

    ``world``: the one that images are taken of at present.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self._configured: tuple[Sequence, tuple[ImageLabel, ...]] | None = None
        self._changing = threading.Lock()

    def change(self, world: World) -> None:
        """Exchange the world; returns once the new one is prepared.

        Images of the old one are taken until then. One frame may hold images of both.
        """
        while True:
            configured = self._configured
            if configured is not None:
                world.configure(*configured)
                world.prepare()  # may take seconds
            with self._changing:
                if configured == self._configured:  # else the sequence was changed meanwhile
                    self.world = world
                    return

    def configure(self, sequence: Sequence, labels: tuple[ImageLabel, ...]) -> None:
        """Set the sequence of the images."""
        with self._changing:
            self._configured = sequence, labels
            self.world.configure(sequence, labels)

    def prepare(self) -> None:
        """Compute what images of the sequence need; may take seconds."""
        self.world.prepare()

    def image(self, label: ImageLabel, *, number: int, device_time_s: float) -> NDArray[np.uint16]:
        """Expose and read one image."""
        return self.world.image(label, number=number, device_time_s=device_time_s)

    def temperature_c(self, device_time_s: float) -> float:
        """Return that of the sensor."""
        return self.world.temperature_c(device_time_s)
