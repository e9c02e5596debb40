"""A scene in front of the simulated sensor: from impulse responses to images."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import ImageLabel, Sequence
from transientcam_driver.simulation.effects import (
    EFFECTS,
    Call,
    Conditions,
    Effect,
    Exposure,
    NormalDraw,
    Stage,
)
from transientcam_driver.simulation.responses import Responses, Truth
from transientcam_driver.simulation.sensor import Sensor

_AMBIENT_C = 25.0


@dataclass(frozen=True, slots=True)
class _Plan:
    """What does not change between the images of a sequence.

    Electrons of an image at phase theta are ``half + re cos(theta) + im sin(theta)``.
    """

    sequence: Sequence
    half_e: NDArray[np.float32]
    quadratures_e: dict[int, tuple[NDArray[np.float32], NDArray[np.float32]]]
    stages: tuple[Stage, ...]


class World:
    """The renderer behind the simulated firmware.

    Parameters
    ----------
    responses
        Impulse responses of all pixels.
    sensor
        What turns electrons into numbers.
    electrons_per_s
        Electrons a second that a relative brightness of 1 gives a pixel.
    effects
        "auto", "on" or "off" by the effect's name.
    seed
        Of all randomness: an image's noise depends on the seed and its sequence number only.
    """

    def __init__(
        self,
        responses: Responses,
        sensor: Sensor,
        *,
        electrons_per_s: float,
        effects: Mapping[str, str],
        seed: int,
    ) -> None:
        self._responses = responses
        self._sensor = sensor
        self._electrons_per_s = electrons_per_s
        self._effects = dict(effects)
        self._seed = seed
        self._brightness = responses.moments(0.0).real
        self._plan: _Plan | None = None

    @property
    def sensor(self) -> Sensor:
        """What turns electrons into numbers."""
        return self._sensor

    def configure(self, sequence: Sequence, labels: tuple[ImageLabel, ...]) -> None:
        """Compute the moments of the impulse responses that the sequence measures."""
        if self._plan is not None and self._plan.sequence == sequence:
            return
        scale_e = self._electrons_per_s * sequence.exposure_s
        sub_phases = sequence.sub_phases
        # G_1: what the division of the exposure leaves of an ideal sinusoid (Sec. 4.1)
        gain = np.sum(sub_phases.weights * np.exp(-1j * np.array(sub_phases.phases_rad)))
        frequencies = {label.harmonic: label.frequency_hz for label in labels}
        quadratures_e = {}
        for harmonic, frequency_hz in frequencies.items():
            if frequency_hz:
                moment = 0.5 * scale_e * gain * self._responses.moments(frequency_hz)
                quadratures_e[harmonic] = (
                    moment.real.astype(np.float32),
                    moment.imag.astype(np.float32),
                )
        self._plan = _Plan(
            sequence,
            (0.5 * scale_e * self._brightness).astype(np.float32),
            quadratures_e,
            self._build(self.conditions(sequence)),
        )

    def image(self, label: ImageLabel, *, number: int, device_time_s: float) -> NDArray[np.uint16]:
        """Expose and read one image: 1/2 (b_0 + Re(b_j G_1 exp(-i theta))), then the effects."""
        random = np.random.Generator(np.random.SFC64(np.random.SeedSequence((self._seed, number))))
        exposure = Exposure(self._mean_e(label), random)
        np.minimum(exposure.signal, np.float32(self._sensor.full_well_e), out=exposure.signal)
        for stage in self._configured().stages:
            stage.apply(exposure)
        return exposure.signal.astype(np.uint16)

    def temperature_c(self, device_time_s: float) -> float:
        """Return that of a sensor that neither warms up nor drifts."""
        return _AMBIENT_C

    def conditions(self, sequence: Sequence) -> Conditions:
        """Return what effects are judged by."""
        lit = self._brightness[self._brightness > 0]
        mean = float(lit.mean()) if lit.size else 0.0
        return Conditions(
            sensor=self._sensor,
            sequence=sequence,
            brightness_e=mean * self._electrons_per_s * sequence.exposure_s,
            pixels=self._brightness.size,
        )

    def calls(self, sequence: Sequence) -> dict[str, Call]:
        """Ask each effect what it says of this scene and a sequence."""
        conditions = self.conditions(sequence)
        return {effect.name: effect.called_for(conditions) for effect in EFFECTS}

    def truth(self) -> Truth:
        """Ground truth, in DN at the exposure set."""
        exposure_s = self._configured().sequence.exposure_s
        scale_dn = self._electrons_per_s * exposure_s / self._sensor.gain_e_per_dn
        delay_s, weight = self._responses.returns()
        return Truth(delay_s, weight * scale_dn, self._responses.kind, self._responses, scale_dn)

    def _mean_e(self, label: ImageLabel) -> NDArray[np.float32]:
        plan = self._configured()
        if not label.illumination:
            return np.zeros_like(plan.half_e)
        if not label.frequency_hz:
            return plan.half_e.copy()
        in_phase, quadrature = plan.quadratures_e[label.harmonic]
        electrons = in_phase * np.float32(np.cos(label.phase_rad))
        electrons += quadrature * np.float32(np.sin(label.phase_rad))
        electrons += plan.half_e
        # |b_j| <= b_0 holds but for rounding
        np.maximum(electrons, np.float32(0), out=electrons)
        return electrons

    def _build(self, conditions: Conditions) -> tuple[Stage, ...]:
        """Build what is called for, and nothing else."""

        def wanted(effect: type[Effect]) -> bool:
            choice = self._effects.get(effect.name, "auto") if effect.optional else "auto"
            return choice == "on" or (choice == "auto" and effect.called_for(conditions).called)

        stages: list[Stage] = []
        for effect in EFFECTS:
            if wanted(effect):
                if stages and stages[-1].adds_variance and not effect.adds_variance:
                    stages.append(NormalDraw())
                stages.append(effect(conditions))
        return tuple(stages)

    def _configured(self) -> _Plan:
        assert self._plan is not None, "no sequence committed"  # noqa: S101  (the firmware's order)
        return self._plan
