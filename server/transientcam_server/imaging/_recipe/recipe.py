"""How images become moments and moments become returns."""

import logging
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import AppliedSequence, RawFrame, Sampling, Sequence
from transientcam_driver.camera import Lamp
from transientcam_driver.sequence import MAX_HARMONICS
from transientcam_moments.comparisons import PLUGINS
from transientcam_moments.reconstruction import OF_ANY_MULTIPLES, automatic
from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging._recipe.calibration import FACTORY_ID, Gains, nominal_gains
from transientcam_server.imaging._recipe.lens import ASSUMED_FIELD_OF_VIEW_DEG, Intrinsics
from transientcam_server.imaging._recipe.moment_frame import OF_IMAGES, MomentFrame
from transientcam_server.settings import ReconstructionSettings

_log = logging.getLogger("transientcam_server.imaging.recipe")
_KERNELS_OF: Final[dict[str, tuple[str, ...]]] = {
    "likelihood": ("likelihood",),
    "two-returns": ("pairs",),
    "maximum-entropy": ("levinson", "peaks"),
}


@dataclass(frozen=True, slots=True)
class SettingsVersion:
    """Settings of the reconstruction, and the number that frames computed with them carry."""

    id: int
    """Counts the settings from 1, those the service started with."""
    settings: ReconstructionSettings

    def followed_by(self, settings: ReconstructionSettings) -> "SettingsVersion":
        """Return the next version; the same one where the settings are equal."""
        return self if settings == self.settings else SettingsVersion(self.id + 1, settings)

    def to_document(self) -> dict[str, Any]:
        """Return the settings by their names, and ``reconstruction_id``."""
        return self.settings.model_dump() | {"reconstruction_id": self.id}


def require_estimator(settings: ReconstructionSettings, sequence: Sequence, *, field: str) -> None:
    """Refuse an estimator and a sequence that do not go together.

    ``field``: which of the two the request changes: "estimator" or "harmonics".
    Raises Problem ``estimator-misfit``.
    """
    if not _serves(settings, sequence.sampling):
        fine = sequence.multiples[-1] > MAX_HARMONICS
        needs = f"multiples up to {MAX_HARMONICS}" if fine else "consecutive multiples"
        raise Problem(
            kinds.ESTIMATOR_MISFIT,
            f"The estimator {settings.estimator} needs {needs} of one frequency, and "
            f"this camera measures the multiples {listed(sequence.multiples)}.",
            field="estimator",
            value=settings.estimator,
            limit="unwrapped-phase" if fine else f"one of {', '.join(OF_ANY_MULTIPLES)}",
        )
    failed = PLUGINS.loaded(settings.estimator) if settings.estimator in PLUGINS.names() else None
    if isinstance(failed, tm.PluginFailed):
        raise unusable(failed)
    least, harmonics = settings.least_harmonics, sequence.harmonics
    if harmonics >= least:
        return
    raise Problem(
        kinds.ESTIMATOR_MISFIT,
        f"The estimator {settings.estimator} needs {least} harmonics, and there are {harmonics}.",
        field=field,
        value=harmonics if field == "harmonics" else settings.estimator,
        limit=f"at least {least}"
        if field == "harmonics"
        else f"one that does with {harmonics} harmonics",
    )


def unusable(failed: tm.PluginFailed) -> Problem:
    """Return the Problem ``estimator-misfit`` of an estimator of another package."""
    told = {"value": failed.name, "limit": "one that can be used"}
    return Problem(kinds.ESTIMATOR_MISFIT, f"{failed}.", field="estimator", **told)


def suited(settings: ReconstructionSettings, sampling: Sampling) -> ReconstructionSettings:
    """Return settings with an estimator that goes with the frequencies of a camera."""
    if _serves(settings, sampling):
        return settings
    _log.warning(
        "the camera measures the multiples %s, which %s cannot serve: the estimator is %s",
        listed(sampling.multiples),
        settings.estimator,
        automatic(sampling.multiples),
    )
    return settings.model_copy(update={"estimator": "automatic"})


def _serves(settings: ReconstructionSettings, sampling: Sampling) -> bool:
    """Return whether the settings' estimator goes with the multiples that are measured."""
    if sampling.multiples[-1:] > (MAX_HARMONICS,):
        return settings.estimator in ("automatic", "unwrapped-phase")
    return sampling.consecutive or settings.estimator in ("automatic", *OF_ANY_MULTIPLES)


def listed(multiples: tuple[int, ...]) -> str:
    """Return multiples in words: "2, 10 and 15"."""
    *first, last = map(str, multiples)
    return f"{', '.join(first)} and {last}" if first else last


@dataclass(frozen=True)
class Recipe:
    """All that a frame is computed with beside its images."""

    applied: AppliedSequence
    settings: ReconstructionSettings
    """``applied``, ``settings``: the sequence that was captured, and how its images become moments
    and returns."""
    full_scale: float
    """The largest value that the sensor gives, in DN."""
    gains: Gains | None = None
    """Of the calibration; None for the nominal ones."""
    settings_version: int = 1
    """Counts the settings there were."""
    intrinsics: Intrinsics | None = None
    """Where the pixels look; None for a usual field of view."""
    sensor: tm.noise.Sensor | None = None
    """Whose noise the images have; None where no one states it."""

    @property
    def technique(self) -> str:
        """The estimator of its frames, by its name in `transientcam_moments`."""
        sampling = self.applied.sequence.sampling
        if self.settings.estimator == "automatic" or not _serves(self.settings, sampling):
            return automatic(sampling.multiples)
        return self.settings.estimator

    @property
    def of_another_package(self) -> bool:
        """Whether that estimator is another package's, which may do anything."""
        return self.technique in PLUGINS.names()

    @property
    def kernels(self) -> tuple[str, ...]:
        """Names of the kernels that its frames take longest without, the most urgent first."""
        harmonics = () if self.waveform is None else ("harmonics",)
        averaging = ("neighbours",) if self.settings.neighbours == "edge-preserving" else ()
        return (*averaging, *_KERNELS_OF.get(self.technique, ()), "reconstruct", *harmonics)

    @property
    def waveform(self) -> NDArray[Any] | None:
        """Harmonics of the modulation (m, K) that are taken out of the moments, if any."""
        known = None if self.gains is None else self.gains.waveform
        return known if self.settings.modulation_harmonics == "take-out" else None

    @property
    def fills(self) -> bool:
        """Whether the frame before is needed."""
        return self.settings.spoilt_images == "fill"

    @property
    def lamp(self) -> Lamp | None:
        """The light; None where its beam is not known."""
        return None if self.intrinsics is None else self.intrinsics.lens.lamp

    def lens(self, height: int, width: int) -> Intrinsics:
        """Return where the pixels look, as it is known or else assumed."""
        if self.intrinsics is not None:
            return self.intrinsics
        return Intrinsics.of_field(ASSUMED_FIELD_OF_VIEW_DEG, width=width, height=height)

    @property
    def base_frequency_hz(self) -> float:
        """The frequency whose period is the unambiguous time of flight."""
        return self.applied.sequence.base_frequency_hz

    @cached_property
    def nominal_gains(self) -> NDArray[np.complex128]:
        """The gains (m + 1,) that sub-phases and the camera's delay alone give."""
        return nominal_gains(self.applied.sequence, delay_s=self.applied.delay_s)

    @cached_property
    def noise_gains(self) -> NDArray[Any]:
        """The gains (m + 1,) that noise is predicted with, of all pixels.

        They are the nominal ones also with a measured calibration, whose pixels differ by their
        noise, too.
        """
        factory = self.gains is not None and self.gains.id == FACTORY_ID
        return self.gains.sizes if factory and self.gains is not None else self.nominal_gains

    @cached_property
    def moment_variance(self) -> NDArray[np.float64]:
        """Variance of the moments of a dark pixel, and how it grows with light: (3, m + 1).

        For each DN of b_0, and for each DN an image of light that is not the camera's; the noise of
        a sensor is an affine function of both. NaN where nobody states it and no image told.
        """
        sequence = self.applied.sequence
        if self.sensor is None:
            return np.full((3, len(sequence.multiples) + 1), np.nan)
        noise = tm.noise.moment_noise(
            np.array([0.0, 1.0, 0.0]),
            self.sensor,
            calibration=self.noise_gains,
            zeroth=sequence.zeroth,
            takes=sequence.takes,
            ambient=np.array([0.0, 0.0, 1.0]),
            phases_rad=sequence.sampling.phases_rad,
        )
        dark, lit, other = np.asarray(noise.variance).T
        return np.stack([dark, lit - dark, other - dark])

    def with_noise_of(self, found: tm.Reconstruction | None) -> "Recipe":
        """Return the recipe with the noise that a frame's images show, where none is stated."""
        noise = None if self.sensor is not None or found is None else found.image_noise
        if not isinstance(noise, tm.noise.ImageNoise):
            return self
        return replace(self, sensor=noise.as_sensor(round(self.full_scale)))

    def reconstruct(
        self,
        raw: RawFrame,
        previous: RawFrame | None = None,
        *,
        averaged: tm.Measured | None = None,
        spread: tm.kernels.Spread = tm.kernels.at_once,
    ) -> tm.Reconstruction:
        """Return the reconstruction of a capture; it computes what is read of it.

        ``previous``, where it has the same sequence, is what corrupt images are filled in from;
        ``averaged`` is what `average` returned of this capture, or its average alone;
        ``spread`` is how compiled kernels use several threads.
        """
        if averaged is not None and averaged.is_alone:
            averaged = averaged.beside(self._measured(raw, previous))
        if averaged is None and isinstance(raw, MomentFrame):
            averaged = self._measured(raw, None)
        if averaged is not None:
            return self._reconstructor(averaged, spread=spread)
        before = _images_before(raw, previous)
        return self._reconstructor(_in_turn(raw), previous=before, spread=spread)

    def average(
        self, raw: RawFrame, previous: RawFrame | None, before: tm.Measured | None
    ) -> tm.Measured:
        """Return the moments of a capture, averaged with those before where nothing changed.

        ``before`` is what this returned of the capture before; it begins anew without.
        """
        return self._reconstructor.average(self._measured(raw, previous), before)

    def _measured(self, raw: RawFrame, previous: RawFrame | None) -> tm.Measured:
        if isinstance(raw, MomentFrame):
            corrupt = any(raw.treated[name] for name in OF_IMAGES[1:])
            return tm.Measured(
                raw.moments, raw.saturated, ambient_dn=raw.ambient_dn, corrupt=corrupt
            )
        before = _images_before(raw, previous)
        return self._reconstructor.measure(_in_turn(raw), previous=before)

    @cached_property
    def _reconstructor(self) -> tm.Reconstructor:
        """What frames with this recipe share: prepared for the first one."""
        sequence, gains = self.applied.sequence, self.gains
        chosen = self.settings.model_copy(update={"estimator": self.technique})
        settings = chosen.for_moments(
            base_frequency_hz=sequence.base_frequency_hz,
            zeroth=sequence.zeroth,
            low_frequency_hz=self.applied.low_frequency_hz or None,
            delay_s=self.applied.delay_s,
            takes=sequence.takes,
            multiples=sequence.multiples,
            phases_rad=sequence.sampling.phases_rad,
            max_range_m=sequence.sampling.max_range_m,
            full_scale=self.full_scale,
            sensor=self.sensor,
        )
        return tm.Reconstructor(
            settings,
            calibration=self.nominal_gains if gains is None else gains.planes,
            bad_pixels=None if gains is None else gains.bad,
            waveform=self.waveform,
        )


def _images_before(raw: RawFrame, previous: RawFrame | None) -> NDArray[np.uint16] | None:
    return None if previous is None or previous.epoch != raw.epoch else _in_turn(previous)


def _in_turn(raw: RawFrame) -> NDArray[np.uint16]:
    """Return the images take by take, whatever order they were captured in."""
    return raw.by_take.reshape(raw.images.shape)
