"""All points of a grid on a scene, one after the other, each kept before the next begins."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from transientcam_driver import Camera, Sequence, Truth, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_experiments.tradeoff import capture, computing, estimating, transport
from transientcam_experiments.tradeoff.grid import Grid
from transientcam_experiments.tradeoff.records import Record, Records, key_of
from transientcam_experiments.tradeoff.truth import Sample, sample_pixels
from transientcam_moments.comparisons import Technique
from transientcam_server.imaging import Recipe
from transientcam_server.settings import ReconstructionSettings

SAMPLE_PIXELS: Final = 400
"""Pixels whose whole impulse responses are compared."""
BEGINS_S: Final = 5.0
"""When a capture begins after power-up: in a scene that moves, something is going on by then."""
_Summary = tuple[dict[str, float | None], dict[str, float | None]]


@dataclass(frozen=True, slots=True)
class Point:
    """One measurement: its settings, and how it runs."""

    kind: str
    scene: str
    point: Mapping[str, Any]
    conditions: Mapping[str, Any]
    run: Callable[["Bench"], _Summary]

    @property
    def key(self) -> str:
        """The key of its record."""
        return key_of(self.kind, self.scene, self.point, self.conditions)

    def measured(self, bench: "Bench", *, clock: Callable[[], float] = time.perf_counter) -> Record:
        """Measure it; ``clock`` is that of the machine, for how long it takes."""
        begin_s = clock()
        values, spread = self.run(bench)
        took_s = clock() - begin_s
        return Record(self.kind, self.scene, self.point, self.conditions, values, spread, took_s)


def points_of(grid: Grid, *, scene: str, repetitions: int, seed: int) -> list[Point]:
    """Return every point of a grid on a scene."""
    conditions = {"repetitions": repetitions, "seed": seed}

    def point(kind: str, settings: Mapping[str, Any], run: Callable[["Bench"], _Summary]) -> Point:
        return Point(kind, scene, settings, conditions, run)

    def capture_point(sequence: Sequence) -> Point:
        return point(
            "capture", sequence.to_document(), lambda bench: bench.capture(sequence, repetitions)
        )

    def computing_point(harmonics: int, task: computing.Task) -> Point:
        return point(
            "computing",
            task.point,
            lambda bench: computing.measure(
                task, bench.moments(harmonics), repetitions=repetitions
            ),
        )

    def estimating_point(technique: Technique, settings: Mapping[str, Any]) -> Point:
        return point(
            "estimating",
            settings,
            lambda bench: estimating.measure_any(
                technique, bench.scene(settings["harmonics"]), repetitions=repetitions, seed=seed
            ),
        )

    def transport_point(harmonics: int, coding: transport.Coding) -> Point:
        return point(
            "transport",
            coding.point,
            lambda bench: transport.measure(
                coding, bench.moments(harmonics), bench.range_m(harmonics), repetitions=repetitions
            ),
        )

    points = [capture_point(sequence) for sequence in grid.sequences]
    for m in grid.harmonics:
        points += [computing_point(m, task) for task in computing.tasks(m, grid)]
        points += [estimating_point(*each) for each in estimating.points(m)]
        points += [transport_point(m, coding) for coding in transport.codings(m)]
    return points


def measure(
    points: list[Point],
    records: Records,
    *,
    scene: str,
    seed: int,
    progress: Callable[[str], None],
    clock: Callable[[], float] = time.perf_counter,
) -> None:
    """Measure the points of a scene, from `points_of`, that are not in the records yet.

    ``progress``: called with the kind of each finished point, also of those measured before.
    ``clock``: of the machine, for how long each point takes.
    Raises SpecError, SceneError where the scene cannot be opened; SequenceError where the camera
    cannot run a sequence of the grid.
    """
    left = [point for point in points if point.key not in records]
    for point in points:
        if point.key in records:
            progress(point.kind)
    if not left:
        return
    bench = Bench(scene, seed=seed)
    for point in left:
        records.append(point.measured(bench, clock=clock))
        progress(point.kind)


def spec_of(scene: str, *, seed: int) -> str:
    """Return the simulated camera in front of a scene: a name, a .toml, or the camera's name."""
    spec = scene if scene.startswith("sim:") else f"sim:{scene}"
    return f"{spec}{'&' if '?' in spec else '?'}seed={seed}"


@contextmanager
def camera_before(scene: str, *, seed: int) -> Iterator[Camera]:
    """Open the simulated camera in front of a scene, `BEGINS_S` after power-up."""
    clock = VirtualClock()
    with open_camera(spec_of(scene, seed=seed), clock=clock) as camera:
        clock.sleep(BEGINS_S)
        yield camera


class Bench:
    """Cameras before a scene, and what several points share.

    Every point gets a camera that was just switched on, at the same time of the scene: what is
    measured does not depend on what was measured before, nor on an interruption in between.
    """

    def __init__(self, scene: str, *, seed: int) -> None:
        self._scene = scene
        self._seed = seed
        self._settings = ReconstructionSettings()
        self._scenes: dict[int, estimating.Scene] = {}
        self._sampled: tuple[Truth, Sample] | None = None

    def capture(self, sequence: Sequence, repetitions: int) -> _Summary:
        """Return how accurately a sequence shows the scene: means and deviations."""
        with camera_before(self._scene, seed=self._seed) as camera:
            applied = camera.configure(sequence)
            return capture.accuracy(
                capture.capture(camera, repetitions),
                self._sample_of,
                applied,
                settings=self._settings,
                bits=camera.capabilities.bits,
            )

    def _sample_of(self, truth: Truth) -> Sample:
        """Sample pixels; of a scene that stands still, only once."""
        if self._sampled is None or not _same_light(self._sampled[0], truth):
            sample = sample_pixels(truth, pixels=SAMPLE_PIXELS, seed=self._seed)
            self._sampled = truth, sample
        return self._sampled[1]

    def moments(self, harmonics: int) -> Any:
        """Return the scene's moments in double precision, of one frame, fit for reconstruction."""
        return self.scene(harmonics).moments

    def scene(self, harmonics: int) -> estimating.Scene:
        """Return those moments and the truth of the same frame."""
        if harmonics not in self._scenes:
            with camera_before(self._scene, seed=self._seed) as camera:
                most_hz = camera.capabilities.max_frequency_hz / harmonics
                sequence = replace(
                    Sequence(harmonics=harmonics), base_frequency_hz=min(23e6, most_hz)
                )
                applied = camera.configure(sequence)
                (frame,) = capture.capture(camera, 1)
                recipe = Recipe(applied, self._settings, 2.0**camera.capabilities.bits - 1.0)
            found = recipe.reconstruct(frame.raw)
            b, noise = found.moments.astype(np.complex128), found.noise
            variance = None if noise is None else np.broadcast_to(noise.variance, b.shape)
            # rounding to single precision reduced the bias that was added
            biased = tm.bias(b, self._settings.bias).moments
            truth = frame.truth
            truth_m = np.where(truth.brightness > 0, truth.range_m, np.nan)
            base_hz = applied.sequence.base_frequency_hz
            self._scenes[harmonics] = estimating.Scene(biased, base_hz, truth_m, variance)
        return self._scenes[harmonics]

    def range_m(self, harmonics: int) -> Any:
        """Return the range image of those moments, at a base frequency of 23 MHz."""
        phase = tm.separate(tm.pisarenko(self.moments(harmonics))).phase_rad
        return tm.range_m(phase, 23e6)


def _same_light(one: Truth, other: Truth) -> bool:
    """Whether two truths hold the same light, whatever the exposure."""
    if one.kind != other.kind or one.delay_s.shape != other.delay_s.shape:
        return False
    share, other_share = (
        truth.weight / max(float(truth.weight.sum()), 1e-30) for truth in (one, other)
    )
    same_times = np.array_equal(one.delay_s, other.delay_s, equal_nan=True)
    return same_times and np.allclose(share, other_share)
