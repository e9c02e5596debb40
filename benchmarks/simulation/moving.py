"""Light that moving surfaces give each other: what it costs, and how true it is.

The time that it takes of a frame is measured beside the same frame without it. Its moments, which
are solved at steps of time, are held against a full solution for every image.
"""

import time
from collections.abc import Iterator
from statistics import median

import numpy as np
from numpy.typing import NDArray

from benchmarks.common.tables import Cell, Table, heads
from benchmarks.simulation.accuracy import SEQUENCES, four_buckets
from benchmarks.simulation.scenes import READOUT_S, SIZE, START_S, scene_named, world_before
from transientcam_driver import Sequence
from transientcam_driver.sequence import ImageLabel
from transientcam_simulation.compiled import IMAGE_KERNELS
from transientcam_simulation.light._paths import light_rays
from transientcam_simulation.light._radiosity import Interreflection
from transientcam_simulation.light._rays import camera_rays
from transientcam_simulation.scene import Scene

SCENES = ("visitor", "ball", "carousel", "passage", "slowest")
FRAMES = 40
_ONE_RAY = {"mixed-pixels": "off"}  # as the full solution has


def costs_s(scene: Scene, sequence: Sequence) -> tuple[float, float, float]:
    """Return what a frame takes, the median and the mean of it that is light between surfaces.

    Frames with it and without it are made in turn.
    """
    worlds = [
        world_before(scene, {"interreflection": choice}, sequence) for choice in ("auto", "off")
    ]
    took_s: list[list[float]] = []
    period_s = sequence.exposure_s + READOUT_S
    for frame in range(FRAMES + 1):
        pair_s = []
        for world in worlds:
            start_s = time.process_time()
            for label in sequence.labels:
                number = frame * sequence.images + label.index
                world.image(label, number=number, device_time_s=START_S + number * period_s)
            pair_s.append(time.process_time() - start_s)
        took_s.append(pair_s)
    of, without = np.array(took_s[1:]).T  # in the first frame is what is computed once
    return median(of), median(of) - median(without), float(np.mean(of - without))


def error(scene: Scene, sequence: Sequence) -> tuple[float, float, float]:
    """Return the error of light between surfaces, over the noise of the moments of a sequence.

    As root mean square, largest, and share of the lit pixels beyond half the noise; without pixels
    beside a silhouette, where a ray may fall on either side of it.
    """
    width, height = SIZE
    lit, dark = (
        world_before(scene, _ONE_RAY | {"interreflection": choice}, sequence)
        for choice in ("auto", "off")
    )
    conditions = lit.conditions(sequence)
    period_s, scale_e = sequence.exposure_s + READOUT_S, 0.5 * conditions.scale_e
    beside = np.zeros((height, width), dtype=bool)

    def image(label: ImageLabel) -> NDArray[np.float64]:
        time_s, now = START_S + label.index * period_s, scene.at(START_S + label.index * period_s)
        found_e, direct_e = (
            of.mean_image_e(label, number=0, device_time_s=time_s).astype(np.float64)
            for of in (lit, dark)
        )
        assert now.camera is not None
        ends = light_rays(now, camera_rays(now.camera, width=width, height=height))
        light = Interreflection(now, ends, width=width, height=height)
        turn = conditions.sub_phase_gain(1) * np.exp(-1j * label.phase_rad)
        full = light.moments(0.0) + turn * light.moments(label.frequency_hz)
        surface = ends.surface.reshape(height, width)
        for axis in (0, 1):
            for by in (-1, 1):
                np.logical_or(beside, np.roll(surface, by, axis) != surface, out=beside)
        off_e: NDArray[np.float64] = (found_e - direct_e - scale_e * full.real).ravel()
        return off_e

    worst_e = np.abs(four_buckets(sequence, image)).max(axis=0)
    brightness = lit.truth(device_time_s=START_S).brightness.ravel()
    gain_e = sequence.exposure_s * scene.light.electrons_per_s / lit.sensor.gain_e_per_dn
    deviation_e = conditions.noise.deviation(brightness / gain_e, 1.0) * conditions.scale_e
    counted = (brightness > 0) & ~beside.ravel()
    over = (worst_e / deviation_e)[counted]
    return float(np.sqrt(np.mean(over**2))), float(over.max()), float(np.mean(over > 0.5))


def tables(*, small: bool = False) -> Iterator[Table]:
    """Measure each scene that moves; ``small``: only with the sequence of video.

    Run it with OMP_NUM_THREADS=1: times are those of one core.
    """
    IMAGE_KERNELS.compile_now()
    columns = heads(
        "scene | sequence | size, noise:.2f | a frame, ms:.1f | of it stated, ms:.1f | "
        "measured, median, ms:.1f | measured, mean, ms:.1f | error, rms:.3f | largest:.2f | "
        "beyond half:.2%"
    )
    rows: list[tuple[Cell, ...]] = []
    for name in SCENES:
        for title in list(SEQUENCES)[: 1 if small else None]:
            scene, sequence = scene_named(name), SEQUENCES[title]
            call = world_before(scene, {}, sequence).calls(sequence)["interreflection"]
            taken: tuple[Cell, ...] = (None, None, None)
            if title == "video":
                taken = tuple(1e3 * each_s for each_s in costs_s(scene, sequence))
            stated = 1e3 * call.cost_s * sequence.images
            rows.append(
                (name, title, call.relative, taken[0], stated, *taken[1:], *error(scene, sequence))
            )
    yield Table("", columns, rows)
