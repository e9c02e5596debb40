"""Measures calibrations with the service's camera, activates them, and watches their drift."""

import asyncio
import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import (
    AppliedSequence,
    CalibrationCapture,
    CalibrationMismatch,
    Camera,
    RawFrame,
    capture_calibration,
)
from transientcam_driver.calibration import DEFAULT_TAKES, TemperatureDrift
from transientcam_server.camera._acquisition import Acquisition
from transientcam_server.camera._calibration_store import (
    CalibrationStore,
    StoredCalibration,
    doubted,
    verdict_of,
)
from transientcam_server.camera._jobs import Job, Jobs
from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging import (
    NOMINAL_ID,
    SWEEP_ON_A_SCENE,
    Calibration,
    Frame,
    History,
    Pipeline,
    Recipe,
    SweepEvaluation,
    Verdict,
    calibration_id,
    contradictory_share,
    evaluate,
    judge,
    load_calibration,
    to_document,
)

_log = logging.getLogger("transientcam_server.camera.calibrator")
_Array = NDArray[Any]
MAX_CAPTURE_BYTES: Final = 2 * 1024**3
"""Of the raw images of one measurement, which are kept in memory until they are averaged."""
JUDGED_FRAMES: Final = 8
"""Frames whose invalid pixels are counted. The best of them stands for the calibration: an image
that lost its synchronisation spoils one frame, and drift all of them."""
DRIFT_EVERY_S: Final = 5.0
_EVALUATING: Final = 0.95  # of the work is done when all is captured


@dataclass(frozen=True, slots=True)
class CalibrationOptions:
    """What to measure: ``frames`` of each kind; ``activate`` uses the result at once.

    ``force`` uses it even where it was not measured on a diffuser. ``harmonics`` sweeps the phase,
    where the camera can.
    """

    name: str = ""
    frames: int = DEFAULT_TAKES
    activate: bool = False
    force: bool = False
    harmonics: bool = True


@dataclass(frozen=True, slots=True)
class Drift:
    """Share of invalid pixels in recent frames, and in the measurement itself (None: unknown)."""

    invalid_share: float
    invalid_share_at_capture: float | None
    frame: int


class Calibrator:
    """Measures, activates and deletes calibrations; on the event loop, slow work on workers.

    ``store``: the stored calibrations.
    ``notify``: called when other gains are used, with the details of a ``calibration-changed``
    notice.
    """

    def __init__(
        self,
        camera: Camera,
        store: CalibrationStore,
        *,
        acquisition: Acquisition,
        pipeline: Pipeline,
        sensor: tm.noise.Sensor,
        jobs: Jobs,
        history: History,
        notify: Callable[[Mapping[str, Any]], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.store = store
        self._camera = camera
        self._acquisition = acquisition
        self._pipeline = pipeline
        self._sensor = sensor
        self._jobs = jobs
        self._history = history
        self._notify = notify
        self._clock = clock
        self._warning: str | None = None
        self._drift: Drift | None = None
        self._drift_of = NOMINAL_ID
        self._drift_until_s = 0.0
        self._judging = asyncio.Lock()
        self._former_id = store.former_id

    @property
    def active_id(self) -> str:
        """The calibration that is used wherever it fits the sequence."""
        calibration = self._pipeline.calibration
        return calibration_id(None if calibration is None else calibration.gains)

    @property
    def former_id(self) -> str | None:
        """The one that was active before; None where none was, or it is deleted."""
        return self._former_id

    @property
    def active_since_s(self) -> float | None:
        """When the active calibration was measured, in Unix time; None without one."""
        calibration = self._pipeline.calibration
        return None if calibration is None else calibration.capture.captured_unix_s

    @property
    def known_drift(self) -> Drift | None:
        """The last result of `drift`, if it is of the active calibration."""
        return self._drift if self._drift_of == self.active_id else None

    def notice(self, applied: AppliedSequence) -> dict[str, Any]:
        """Return which gains are used with a sequence, and why not those of the active one."""
        misfit = self._pipeline.misfit(applied)
        return {
            "calibration_id": calibration_id(self._pipeline.gains_for(applied)),
            "reason": None if misfit is None else str(misfit),
            "warning": self._warning,
        }

    def observe(self, temperature_c: float | None, applied: AppliedSequence) -> None:
        """Compare a frame's temperature with that of the active calibration, and tell of both."""
        calibration = self._pipeline.calibration
        calibrated_c = None if calibration is None else calibration.capture.temperature_c
        drift = TemperatureDrift.between(calibrated_c, temperature_c)
        before, self._warning = self._warning, None if drift is None else drift.warning
        if (before is None) != (self._warning is None):
            if self._warning is not None:
                _log.warning("the calibration may not hold: %s", self._warning)
            self._notify(self.notice(applied))

    def misfit(
        self, stored: StoredCalibration, applied: AppliedSequence
    ) -> CalibrationMismatch | None:
        """Return why a calibration does not fit a sequence of this camera; None where it does."""
        return stored.subject.misfit(applied, self._camera.capabilities)

    async def activate(
        self, new_id: str, applied: Callable[[], AppliedSequence], *, force: bool = False
    ) -> None:
        """Use a calibration, or the nominal gains, from the next frame on.

        One that was not measured on a diffuser is used only with ``force``.

        Raises Problem ``unknown-calibration``, ``calibration-misfit``, ``calibration-doubted``.
        """
        calibration = None
        if new_id != NOMINAL_ID:
            stored = await asyncio.to_thread(self.store.get, new_id)
            if (misfit := self.misfit(stored, applied())) is not None:
                raise misfit
            if not (force or stored.usable):
                raise doubted(stored.verdict)
            loaded, _ = await self._pipeline.workers.run_long(load_calibration, stored.path)
            # the sequence may be another one by now
            loaded.capture.require_fit(applied(), self._camera.capabilities)
            calibration = loaded
        if self.active_id != new_id:
            _log.info("frames are calibrated by %s", new_id)
            self._former_id = self.active_id
            self._pipeline.calibration = calibration
            self._notify(self.notice(applied()))
        await asyncio.to_thread(self.store.remember_active, new_id, self._former_id)

    async def restore(self, applied: Callable[[], AppliedSequence]) -> None:
        """Use the calibration again that was active before the present one.

        Once more, and the present one is used again.

        Raises Problem ``no-former-calibration``, ``calibration-misfit``.
        """
        if self._former_id is None:
            raise Problem(kinds.NO_FORMER_CALIBRATION, "There is none to return to.")
        await self.activate(self._former_id, applied, force=True)  # it was active already

    async def delete(self, deleted_id: str) -> StoredCalibration:
        """Delete a calibration that is not active.

        Raises Problem ``unknown-calibration``, ``calibration-in-use``, ``calibration-not-stored``.
        """
        if deleted_id == self.active_id != NOMINAL_ID:
            raise Problem(
                kinds.CALIBRATION_IN_USE,
                "Frames are calibrated by it.",
                field="calibration",
                value=deleted_id,
            )
        deleted = await asyncio.to_thread(self.store.delete, deleted_id)
        if self._former_id == deleted_id:
            self._former_id = None
            await asyncio.to_thread(self.store.remember_active, self.active_id, None)
        return deleted

    def measure(
        self, options: CalibrationOptions, applied: Callable[[], AppliedSequence], *, offs: int
    ) -> Job:
        """Start measuring with the present sequence; the job's result is the calibration.

        ``offs`` is as `Acquisition.occupy` has it.

        Raises Problem ``camera-busy``, ``too-many-jobs``, ``calibration-not-stored``,
        ``invalid-request`` where the images would not fit into memory.
        """
        self._acquisition.require_free()
        once = self._camera.validate(replace(applied().sequence, takes=1, take_order="sequential"))
        most = MAX_CAPTURE_BYTES // (once.images * self._camera.capabilities.image_bytes)
        if options.frames > most:
            raise Problem(
                kinds.INVALID_REQUEST,
                f"{options.frames} frames of this sequence do not fit into memory.",
                field="frames",
                value=options.frames,
                limit=f"at most {most}",
            )

        async def work(job: Job) -> dict[str, Any]:
            await asyncio.to_thread(self.store.require_room)  # checked before anything is captured
            takes = _Takes()
            sweep = SweepEvaluation(self._camera.capabilities, takes=options.frames)
            measuring = self._acquisition.occupy(
                job.id,
                lambda camera, go_on: _capture(camera, job, options, takes, sweep, go_on),
                offs=offs,
            )
            capture = await asyncio.wrap_future(measuring)
            # the sequence may have been changed since the request, and may be while this goes on
            measured = self._camera.validate(capture.sequence)
            job.report(_EVALUATING, "evaluating")
            calibration, _ = await self._pipeline.workers.run_long(evaluate, capture)
            share, _ = await self._pipeline.workers.run_long(
                self._share_of_takes, calibration, takes, measured
            )
            verdict = await self._judged(calibration, measured)
            if verdict.word == "scene" and capture.waveform is not None:
                capture = replace(capture, waveform=None)
                sweep.reason = SWEEP_ON_A_SCENE
            notes = {
                "name": options.name,
                "invalid_share": share,
                "verdict": verdict.to_document(),
                "forced": options.force,
            }
            stored = await asyncio.to_thread(self.store.add, replace(capture, notes=notes))
            activated = options.activate and stored.usable
            if activated:
                await self.activate(stored.id, applied)
            return {
                "calibration": stored.id,
                "bad_pixels": calibration.gains.bad_pixels,
                "rejected_images": capture.rejected_images,
                "images": int(capture.kept.size),
                "invalid_share": share,
                "verdict": verdict.to_document(),
                "harmonics": to_document(capture.waveform),
                "no_harmonics": sweep.reason if options.harmonics else None,
                "activated": activated,
                "former": self._former_id if activated else None,
            }

        return self._jobs.start("calibration", work)

    async def _judged(self, measured: Calibration, applied: AppliedSequence) -> Verdict:
        """Judge a measurement, compared with the active calibration where that is none of a scene.

        The active one is what the user relies on, forced or not.
        """
        reference = self._pipeline.calibration
        if reference is not None:
            fits = self._pipeline.misfit(applied) is None
            of_scene = verdict_of(reference.capture).word == "scene"
            reference = reference if fits and not of_scene else None
        full_scale = 2.0**self._camera.capabilities.bits - 1.0
        judging = partial(judge, full_scale=full_scale, reference=reference)
        verdict, _ = await self._pipeline.workers.run_long(
            judging, measured.capture, measured.gains.bad
        )
        return verdict

    async def drift(self) -> Drift | None:
        """Return the drift of the active calibration; None without one, or without frames of it."""
        async with self._judging:
            if self._drift_of != self.active_id or self._clock() > self._drift_until_s:
                self._drift = await self._drifted()
                self._drift_of = self.active_id
                self._drift_until_s = self._clock() + DRIFT_EVERY_S
            return self._drift

    async def _drifted(self) -> Drift | None:
        calibration = self._pipeline.calibration
        last = self._history.last
        if calibration is None or last is None:
            return None
        shares = []
        for number in range(last, max(0, last - JUDGED_FRAMES), -1):
            try:
                frame = self._history.frame(number)
            except Problem:  # no older ones are there
                break
            if frame.recipe.gains is calibration.gains:
                share = await self._share_of(frame)
                if share is not None:
                    shares.append(share)
        if not shares:
            return None
        noted: Any = calibration.capture.notes.get("invalid_share")  # anything, in imported files
        known = isinstance(noted, int | float) and 0 <= noted <= 1
        return Drift(min(shares), float(noted) if known else None, last)

    async def _share_of(self, frame: Frame) -> float | None:
        try:
            found = await frame.reconstruction("moments")
            share, _ = await self._pipeline.workers.run(contradictory_share, frame.recipe, found)
        except Exception:  # a frame that cannot be computed is no sign of drift
            _log.exception("frame %d: counting its invalid pixels failed", frame.number)
            return None
        return share

    def _share_of_takes(
        self, calibration: Calibration, takes: "_Takes", once: AppliedSequence
    ) -> float | None:
        """Return the share of the measurement's own frames, each by itself; runs on a worker."""
        full_scale = 2.0**self._camera.capabilities.bits - 1.0
        recipe = Recipe(
            once,
            self._pipeline.reconstruction.settings,
            full_scale,
            calibration.gains,
            sensor=self._sensor,
        )
        shares = []
        for images in takes.frames():
            raw = RawFrame(0, 0, images, once.labels, 0.0, 0.0, 0.0, 0.0, 0)
            found = recipe.reconstruct(raw)
            if (share := contradictory_share(recipe, found)) is not None:
                shares.append(share)
        return min(shares, default=None)


class _Takes:
    """Averages takes, and keeps the last few of each image."""

    def __init__(self) -> None:
        self._kept: list[_Array] = []

    def average(self, takes: _Array) -> tuple[_Array, _Array]:
        self._kept.append(takes[-JUDGED_FRAMES:].copy())
        averaged: tuple[_Array, _Array] = tm.average_takes(takes)
        return averaged

    def frames(self) -> list[_Array]:
        """Return frames (N, H, W)."""
        return list(np.concatenate(self._kept, axis=1))


def _capture(
    camera: Camera,
    job: Job,
    options: CalibrationOptions,
    takes: _Takes,
    sweep: SweepEvaluation,
    go_on: Callable[[], None],
) -> CalibrationCapture:
    def progress(done: int, total: int) -> None:
        job.report(_EVALUATING * done / total, "capturing")
        go_on()

    def average(of_one_image: _Array) -> tuple[_Array, _Array]:
        job.report(_EVALUATING, "averaging")
        go_on()
        return takes.average(of_one_image)

    return capture_calibration(
        camera,
        takes=options.frames,
        average=average,
        waveform=sweep if options.harmonics else None,
        progress=progress,
    )
