"""All points of a grid on a scene, one after the other, each kept before the next begins."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import transientcam_moments as tm
from transientcam_driver import Camera, Sequence, open_camera
from transientcam_driver.simulation.clock import VirtualClock

from transientcam_server.products import STAGES, Recipe
from transientcam_server.settings import ReconstructionSettings
from transientcam_server.tradeoff import capture, computing, transport
from transientcam_server.tradeoff.grid import Grid
from transientcam_server.tradeoff.records import Record, Records, key_of
from transientcam_server.tradeoff.truth import sample_pixels

SAMPLE_PIXELS: Final = 400
"""Pixels whose whole impulse responses are compared."""
_Summary = tuple[dict[str, float | None], dict[str, float | None]]


@dataclass(frozen=True, slots=True)
class Point:
    """One thing to measure: what it is, and how."""

    kind: str
    scene: str
    point: Mapping[str, Any]
    conditions: Mapping[str, Any]
    run: Callable[["_Bench"], _Summary]

    @property
    def key(self) -> str:
        """As of the record that it becomes."""
        return key_of(self.kind, self.scene, self.point, self.conditions)


def points_of(grid: Grid, *, scene: str, repetitions: int, seed: int) -> list[Point]:
    """Return everything that a grid asks for on a scene."""
    conditions = {"repetitions": repetitions, "seed": seed}

    def point(kind: str, settings: Mapping[str, Any], run: Callable[["_Bench"], _Summary]) -> Point:
        return Point(kind, scene, settings, conditions, run)

    def capture_point(sequence: Sequence) -> Point:
        return point(
            "capture",
            sequence.to_document(),
            lambda bench: bench.capture(sequence, repetitions),
        )

    def computing_point(harmonics: int, task: computing.Task) -> Point:
        return point(
            "computing",
            task.point,
            lambda bench: computing.measure(
                task, bench.moments(harmonics), repetitions=repetitions
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
        points += [transport_point(m, coding) for coding in transport.codings(m)]
    return points


def measure(
    points: list[Point], records: Records, *, scene: str, seed: int, progress: Callable[[str], None]
) -> None:
    """Measure what is not in the records yet.

    Parameters
    ----------
    points
        Of one scene, from `points_of`.
    records
        Where results are and go.
    scene, seed
        Which world, and its chance.
    progress
        Is told the kind of each point when it is done, also of those that were there already.

    Raises
    ------
    SpecError, SceneError
        The scene cannot be opened.
    SequenceError
        The camera cannot run a sequence of the grid.
    """
    left = [point for point in points if point.key not in records]
    for point in points:
        if point.key in records:
            progress(point.kind)
    if not left:
        return
    with open_camera(spec_of(scene, seed=seed), clock=VirtualClock()) as camera:
        bench = _Bench(camera, seed=seed)
        for point in left:
            values, spread = point.run(bench)
            records.append(Record(point.kind, scene, point.point, point.conditions, values, spread))
            progress(point.kind)


def spec_of(scene: str, *, seed: int) -> str:
    """Return the simulated camera in front of a scene: a name, a .toml, or the camera's name."""
    spec = scene if scene.startswith("sim:") else f"sim:{scene}"
    return f"{spec}{'&' if '?' in spec else '?'}seed={seed}"


class _Bench:
    """A camera before a scene, and what several points share."""

    def __init__(self, camera: Camera, *, seed: int) -> None:
        self._camera = camera
        self._seed = seed
        self._settings = ReconstructionSettings()
        self._moments: dict[int, Any] = {}

    def capture(self, sequence: Sequence, repetitions: int) -> _Summary:
        applied = self._camera.configure(sequence)
        frames, truth = capture.capture(self._camera, repetitions)
        return capture.accuracy(
            frames,
            truth,
            sample_pixels(truth, pixels=SAMPLE_PIXELS, seed=self._seed),
            applied,
            settings=self._settings,
            bits=self._camera.capabilities.bits,
        )

    def moments(self, harmonics: int) -> Any:
        """Return the scene's moments in double precision, of one frame, fit for reconstruction."""
        if harmonics not in self._moments:
            most_hz = self._camera.capabilities.max_frequency_hz / harmonics
            sequence = replace(Sequence(harmonics=harmonics), base_frequency_hz=min(23e6, most_hz))
            applied = self._camera.configure(sequence)
            (frame,), _ = capture.capture(self._camera, 1)
            recipe = Recipe(applied, self._settings, 2.0**self._camera.capabilities.bits - 1.0)
            b = STAGES["moments"].compute(recipe, frame).moments.astype(np.complex128)
            # rounding to single precision took from what biasing had given
            self._moments[harmonics] = tm.bias(b, self._settings.bias).moments
        return self._moments[harmonics]

    def range_m(self, harmonics: int) -> Any:
        """Return the range image of those moments, at a base frequency of 23 MHz."""
        phase = tm.separate(tm.pisarenko(self.moments(harmonics))).phase_rad
        return tm.range_m(phase, 23e6)


def scenes_in(records: Records) -> Iterator[str]:
    """Yield the scenes that there are results of, in the order of measurement."""
    yield from dict.fromkeys(record.scene for record in records)
