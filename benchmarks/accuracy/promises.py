"""Plans held to what they promise, by the camera that they are for.

A scene is looked at, or one frame of it is taken; each target is planned for 90 % of the pixels,
and captured with other noise and a calibration of its own sequence. A grid of sequences, with every
estimator, is captured beside it: the quickest of it that truly reaches a target, in many captures,
as a few may hold no image that was lost.
"""

import math
import operator
import os
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.accuracy import worlds
from benchmarks.accuracy.capturing import CAPTURE_SEED, LOOK_SEED, PIXELS, SETTINGS, recipe_of
from benchmarks.accuracy.held import SHARE, Outcome, tables_of
from benchmarks.common.tables import Table, heads
from transientcam_driver import Camera, Sequence, capture_calibration, open_camera
from transientcam_driver.clock import Clock, RealClock, VirtualClock
from transientcam_experiments.tradeoff.capture import capture
from transientcam_server.camera import sensor_of, start_with
from transientcam_server.errors import Problem
from transientcam_server.imaging import Gains, evaluate, factory_gains, ranges_m, typical_deviation
from transientcam_server.imaging._errors_of_range.noise import moment_noise
from transientcam_server.planning import ESTIMATORS, Goal, Planner, SceneStatistics, takes_of
from transientcam_server.planning._scene.look import look_of_frame
from transientcam_server.planning._search.families import FREQUENCY_FACTORS, HARMONICS
from transientcam_server.settings import SensorSettings, SequenceSettings

OWN: Final = Path(__file__).parent / "scenes"
CAPTURES: Final = 4
_CONFIRMING: Final = (128, 13)  # captures, and their seed
_COLD_S: Final = 5.0
_WARM_S: Final = 1500.0
_WARMS_S: Final = 20.0
_CALIBRATION_TAKES: Final = 16
_FILLED: Final = 0.6


@dataclass(frozen=True)
class Device:
    """A camera before a scene, and how it is planned for."""

    spec: str
    scenes: tuple[str, ...]
    targets_m: tuple[float, ...]
    one_frame: bool = False
    ideal: bool = False
    warmer_c: float = 0.0
    """Than at its calibration."""


_OWN_SCENES: Final = ("wall", "corner", "mirrors", str(OWN / "yard.toml"))
_FEW: Final = ("wall", "corner", "mirrors")
_PROTOTYPE: Final = "sim:{scene}?device=prototype&seed={seed}"
DEVICES: Final = {
    "ideal": Device("sim:{scene}?seed={seed}", _OWN_SCENES, (0.05, 0.02, 0.005), ideal=True),
    "prototype": Device(_PROTOTYPE, _OWN_SCENES, (0.05, 0.02, 0.01)),
    "prototype, 10 °C warmer": Device(_PROTOTYPE, _OWN_SCENES, (0.05, 0.02, 0.01), warmer_c=10.0),
    "relay": Device("sim:{scene}?seed={seed}", _FEW, (0.05, 0.02, 0.005), True),
    "TOFcam660": Device(
        "tofcam660:emulated?scene={scene}&settle_s=0&seed={seed}", _FEW, (0.1, 0.05, 0.02), True
    ),
    "OPT8241": Device("opt8241:emulated?scene={scene}&seed={seed}", _FEW, (0.1, 0.05, 0.02), True),
}
KINECT: Final = Device("kinect2:emulated?scene={scene}&seed={seed}", _FEW, (), True)


def tables(
    *,
    devices: tuple[str, ...] = (),
    scenes: tuple[str, ...] = (),
    seed: int | None = None,
    processes: int = os.cpu_count() or 1,
) -> Iterator[Table]:
    """Plan and capture with all cameras and scenes, or those named, or random scenes of a seed."""
    with (
        ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool,
        tempfile.TemporaryDirectory() as folder,
    ):
        drawn = () if seed is None else worlds.write(Path(folder), len(worlds.KINDS), seed=seed)
        work = [
            (name, scene)
            for name in devices or DEVICES
            for scene in drawn or scenes or DEVICES[name].scenes
        ]
        found = [each for kept in pool.map(held, *zip(*work, strict=True)) for each in kept]
        yield from tables_of(found)
        if not devices:
            rows = [each for kept in pool.map(held_takes, KINECT.scenes) for each in kept]
            columns = heads("scene | takes | predicted, mm:.2f | captured, mm:.2f")
            yield Table("What takes give: Kinect v2", columns, rows)


@contextmanager
def opened(device: Device, scene: str, seed: int) -> Iterator[tuple[Camera, Clock]]:
    """Open a camera some seconds after power-up, with the sequence that a daemon begins with."""
    # what the TOFcam660 sends goes over real sockets
    real = device.spec.startswith("tofcam660")
    clock: Clock = RealClock() if real else VirtualClock()
    with open_camera(device.spec.format(scene=scene, seed=seed), clock=clock) as camera:
        start_with(camera, SequenceSettings())
        if isinstance(clock, VirtualClock):
            clock.sleep(_COLD_S if device.ideal or device.warmer_c else _WARM_S)
        yield camera, clock


def held(name: str, scene: str) -> list[Outcome]:
    """Plan all targets before a scene, and capture what is recommended, and the grid."""
    device, word = DEVICES[name], Path(scene).stem
    plans: list[tuple[float, Any]] = []
    with opened(device, scene, LOOK_SEED) as (camera, clock):
        planner = Planner(camera.capabilities, _sensor(camera), SETTINGS)
        statistics = _seen(device, planner, camera, clock)
        base = camera.applied.sequence if device.one_frame else Sequence()
        for target_m in device.targets_m:
            try:
                goal = Goal(range_error_m=target_m, share=SHARE, base=base)
                plans.append((target_m, planner.plan(goal, statistics).recommended))
            except Problem as problem:
                plans.append((target_m, problem))
        longest_s = _sensor(camera).brightest / statistics.brightest_dn_per_s
        grid = list(_grid(camera, base, 0.9 * longest_s))
    dimmest = float(statistics.brightness_dn_per_s.min())
    chosen = [each for _, each in plans if not isinstance(each, Problem)]
    sequences = [*(each.applied.sequence for each in chosen), *grid]
    captured = list(_captured(device, scene, sequences, dimmest))
    of_grid = [found for each in captured[len(chosen) :] for found in each.every()]

    @cache
    def confirmed(sequence: Sequence, estimator: str) -> NDArray[Any]:
        (many,) = _captured(device, scene, [sequence], dimmest, *_CONFIRMING)
        return many.off_m(estimator)

    outcomes, of_plans = [], iter(captured)
    for target_m, plan in plans:
        reaching = sorted((each for each in of_grid if _reaches(each.off_m, target_m)), key=_time)
        truly = (each for each in reaching if _reaches(confirmed(*each.what), target_m))
        quickest_s = next(map(_time, truly), math.inf)
        if isinstance(plan, Problem):
            refused = bool(plan.extensions.get("decided", True))
            limit_m = plan.extensions["limit"]
            best = f"best {1e3 * limit_m:.3g} mm" if isinstance(limit_m, float) else plan.detail
            said = f"{'refused' if refused else 'undecided'}: {best}"
            outcomes.append(
                Outcome(name, word, target_m, said, quickest_s=quickest_s, refused=refused)
            )
            continue
        off_m = next(of_plans).off_m(plan.estimator)
        within = plan.predicted.within
        outcomes.append(
            Outcome(
                name,
                word,
                target_m,
                plan.in_words(),
                plan.applied.capture_s,
                (within.median, within.low, within.high),
                float(np.quantile(off_m, SHARE, method="higher")),
                float((off_m <= target_m).mean()),
                plan.predicted.bias_known,
                quickest_s,
            )
        )
    for each in outcomes:
        print(*each.row(), flush=True)
    return outcomes


def held_takes(scene: str) -> list[tuple[Any, ...]]:
    """Predict by one frame what takes give, and capture them."""
    rows = []
    with opened(KINECT, scene, CAPTURE_SEED) as (camera, _):
        camera.configure(replace(camera.applied.sequence, takes=1))
        recipe = recipe_of(camera, factory_gains(camera.factory))
        (frame,) = capture(camera, 1)
        for each in takes_of(frame.raw, recipe, camera.capabilities, takes=(1, 4, 16)):
            camera.configure(replace(camera.applied.sequence, takes=each.takes))
            plain = replace(recipe, applied=camera.applied)
            plain = replace(plain, settings=SETTINGS.model_copy(update={"neighbours": "none"}))
            found = np.stack([plain.reconstruct(each.raw).range_m for each in capture(camera, 4)])
            std_m = typical_deviation(found.reshape((len(found), -1)))
            std_m = std_m[np.isfinite(std_m) & (std_m > 0)]
            rows.append((scene, each.takes, 1e3 * each.range_std_m, 1e3 * float(np.median(std_m))))
    return rows


def _sensor(camera: Camera) -> tm.noise.Sensor:
    return sensor_of(camera, SensorSettings())


def _seen(device: Device, planner: Planner, camera: Camera, clock: Clock) -> SceneStatistics:
    if not device.one_frame:
        calibrated_c = _temperature_c(camera)
        _warm(device, camera, clock)
        return planner.look(camera, Sequence(), calibrated_c=calibrated_c)
    recipe = recipe_of(camera, None if device.ideal else _calibrated(camera))
    (frame,) = capture(camera, 1)
    return look_of_frame(recipe, recipe.reconstruct(frame.raw), frame.raw, None)


def _temperature_c(camera: Camera) -> float:
    (frame,) = capture(camera, 1)
    return frame.raw.temperature_c or 0.0


def _warm(device: Device, camera: Camera, clock: Clock) -> None:
    """Wait until the device is so much warmer."""
    if device.warmer_c and isinstance(clock, VirtualClock):
        until_c = _temperature_c(camera) + device.warmer_c
        while _temperature_c(camera) < until_c:
            clock.sleep(_WARMS_S)


def _calibrated(camera: Camera) -> Gains:
    """Calibrate the present sequence through the simulation's diffuser."""
    before, about, sensor = camera.applied.sequence, camera.capabilities, _sensor(camera)
    assert camera.simulation is not None
    camera.simulation.change(diffuser=True)
    camera.configure(about.nearest(replace(before, exposure_s=about.min_exposure_s, takes=1)))
    (frame,) = capture(camera, 1)
    light_dn = float(frame.raw.images.max()) - sensor.dark_dn
    fills_s = camera.applied.sequence.exposure_s * _FILLED * sensor.brightest / max(light_dn, 1.0)
    exposure_s = min(max(fills_s, about.min_exposure_s), about.max_exposure_s, 0.02)
    camera.configure(about.nearest(replace(before, exposure_s=exposure_s, takes=1)))
    measured = capture_calibration(camera, takes=_CALIBRATION_TAKES, average=tm.average_takes)
    camera.simulation.change(diffuser=False)
    camera.configure(before)
    return evaluate(measured).gains


def _grid(camera: Camera, base: Sequence, longest_s: float) -> Iterator[Sequence]:
    """Yield sequences of the most harmonics: the others are parts of them."""
    about = camera.capabilities
    shortest_s = max(2e-4, about.min_exposure_s)
    longest_s = max(min(longest_s, about.max_exposure_s), shortest_s)
    for factor in FREQUENCY_FACTORS:
        frequency_hz = factor * base.base_frequency_hz
        most = [m for m in HARMONICS if m * frequency_hz <= about.max_frequency_hz]
        if not most or frequency_hz < about.min_frequency_hz:
            continue
        for exposure_s, takes in (
            (shortest_s, 1),
            (math.sqrt(shortest_s * longest_s), 1),
            (longest_s, 1),
            (longest_s, 4),
        ):
            yield about.nearest(
                replace(
                    base,
                    base_frequency_hz=frequency_hz,
                    harmonics=most[-1],
                    exposure_s=exposure_s,
                    takes=takes,
                    zeroth="estimated",
                )
            )


class Part(NamedTuple):
    """A sequence of a grid with an estimator, and errors (K P) of its captures in m."""

    taken_s: float
    what: tuple[Sequence, str]
    off_m: NDArray[Any]


_time = operator.attrgetter("taken_s")


def _reaches(off_m: NDArray[Any], target_m: float) -> bool:
    return bool((off_m <= target_m).mean() >= SHARE)


@dataclass(frozen=True)
class Captured:
    """Smoothed moments and their variance (m + 1, K P) of captures, and the truth (K P) in m."""

    camera: Any
    sequence: Sequence
    moments: NDArray[Any]
    variance: NDArray[Any]
    true_m: NDArray[Any]

    def off_m(self, estimator: str, harmonics: int | None = None) -> NDArray[Any]:
        """Return how far ranges (K P) are off, by the first harmonics; infinite without one."""
        m = len(self.moments) if harmonics is None else harmonics + 1
        frequency_hz = self.sequence.base_frequency_hz
        found = self.moments[:m], self.variance[:m]
        range_m = ranges_m(*found, estimator, frequency_hz, SETTINGS)
        off_m: NDArray[Any] = np.nan_to_num(np.abs(range_m - self.true_m), nan=math.inf)
        return off_m

    def every(self) -> Iterator[Part]:
        """Yield the sequences of the first harmonics with each estimator."""
        for m in HARMONICS:
            if m < len(self.moments):
                applied = self.camera.apply(replace(self.sequence, harmonics=m))
                for estimator in ESTIMATORS if m > 1 else ("single-frequency",):
                    what = applied.sequence, estimator
                    yield Part(applied.capture_s, what, self.off_m(estimator, m))


def _captured(
    device: Device,
    scene: str,
    sequences: list[Sequence],
    dimmest: float,
    captures: int = CAPTURES,
    seed: int = CAPTURE_SEED,
) -> Iterator[Captured]:
    """Calibrate for all sequences, and capture each."""
    pixels = None
    with opened(device, scene, seed) as (camera, clock):
        gains: dict[tuple[float, int], Gains | None] = {}
        for each in sequences:
            key = each.base_frequency_hz, each.harmonics
            if key not in gains:
                camera.configure(each)
                gains[key] = None if device.ideal else _calibrated(camera)
        _warm(device, camera, clock)
        for sequence in sequences:
            applied = camera.configure(sequence)
            recipe = recipe_of(camera, gains[sequence.base_frequency_hz, sequence.harmonics])
            parts = []
            for frame in capture(camera, captures, middle=True):
                truth = frame.truth
                if pixels is None:
                    enough = truth.brightness >= max(1e-12, dimmest * sequence.exposure_s)
                    lit = np.flatnonzero(truth.lit & enough)
                    random = np.random.default_rng(1)
                    pixels = random.choice(lit, min(PIXELS // 2, lit.size), replace=False)
                found = recipe.reconstruct(frame.raw)
                b = np.asarray(found.smoothed)
                variance = np.asarray(moment_noise(recipe, found).variance)
                of_pixels = (
                    np.broadcast_to(each, b.shape).reshape((len(b), -1))[:, pixels]
                    for each in (b, variance)
                )
                parts.append((*of_pixels, truth.range_m.ravel()[pixels]))
            b, variance, true_m = (
                np.concatenate(each, axis=-1) for each in zip(*parts, strict=True)
            )
            yield Captured(camera.capabilities, applied.sequence, b, variance, true_m)
