"""The simulation held against a path tracer that shares nothing with it but the scene's file.

Moments of some pixels drawn at random, of the light alone and before noise: what images of the
camera give on average, less what the tracer says of them, in units of the noise of one moment.
"""

from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.common.tables import Table, heads
from benchmarks.simulation.accuracy import SEQUENCES
from benchmarks.simulation.path_tracer import REPETITIONS, Tracer
from benchmarks.simulation.scenes import (
    BUILT_IN,
    READOUT_S,
    SIZE,
    START_S,
    scene_named,
    unseen,
    world_before,
)
from transientcam_driver.sequence import ImageLabel, Sequence
from transientcam_simulation.effects import EFFECTS, LightEffect
from transientcam_simulation.scene import Scene

_CERTAIN = 3  # standard errors of the tracer: what chance puts beyond, in 0.3 % of the moments

Values = NDArray[np.float64]


class Verdict(NamedTuple):
    """The simulation less the tracer, in units of the noise, over pixels that any light reaches.

    ``error`` is the tracer's own, ``beyond_half`` the share of pixels that differ by more than
    half the noise and three times their error; ``missing`` are the kinds of light that the
    simulation says it cannot make, with their sizes.
    """

    scene: str
    sequence: str
    rms: float
    error: float
    largest: float
    beyond_half: float
    range_mm: float
    missing: tuple[str, ...]


class Told(NamedTuple):
    """What the tracer says of pixels: moments (repetition, frequency, pixel) at a time."""

    pixel: NDArray[np.intp]
    frequencies_hz: Values
    light_at: Callable[[float], NDArray[np.complex128]]
    size: tuple[int, int]


def told(
    scene: Scene,
    sequences: tuple[str, ...],
    *,
    pixels: int,
    paths: int,
    as_stated: bool = True,
    size: tuple[int, int] = SIZE,
) -> Told:
    """Have pixels drawn at random traced, when they are asked for, for all these sequences."""
    labels = (label for each in sequences for label in SEQUENCES[each].labels)
    frequencies = np.array(sorted({0.0, *(label.frequency_hz for label in labels)}))
    pixel = np.random.default_rng(1).choice(size[0] * size[1], pixels, replace=False)
    pixel.sort()

    @lru_cache(maxsize=1)
    def light_at(time_s: float) -> NDArray[np.complex128]:
        tracer = Tracer(scene, size, time_s=time_s, as_stated=as_stated)
        return tracer.moments(pixel, frequencies, paths=paths)

    return Told(pixel, frequencies, light_at, size)


def judge(scene: Scene, sequence_name: str, by: Told) -> Verdict:
    """Compare moments of some pixels over a frame."""
    sequence = SEQUENCES[sequence_name]
    of_light = [each.name for each in EFFECTS if issubclass(each, LightEffect)]
    others = {each.name: "off" for each in EFFECTS if each.optional and each.name not in of_light}
    world = world_before(scene, others, sequence, by.size)
    period_s = sequence.exposure_s + READOUT_S
    scale_e = scene.light.electrons_per_s * sequence.exposure_s
    gain = world.conditions(sequence).sub_phase_gain(1)

    def simulated(label: ImageLabel, time_s: float) -> Values:
        mean_e = world.mean_image_e(label, number=label.index, device_time_s=time_s)
        return mean_e.ravel()[by.pixel].astype(np.float64)

    def traced(label: ImageLabel, time_s: float) -> Values:
        """Electrons of an image by the tracer, in each of its repetitions."""
        light = by.light_at(time_s + sequence.exposure_s / 2 if scene.moves else 0.0)
        moment = light[:, list(by.frequencies_hz).index(label.frequency_hz)]
        turned = moment * gain * np.exp(-1j * label.phase_rad)
        electrons: Values = scale_e / 2 * (light[:, 0] + turned).real
        return electrons

    found, repeated = (_moments(sequence, period_s, image) for image in (simulated, traced))
    expected = repeated.mean(axis=1)
    spread = np.sqrt(np.var(repeated, axis=1, ddof=1) / REPETITIONS)
    brightness_e = scale_e * by.light_at(START_S if scene.moves else 0.0)[:, 0].real.mean(axis=0)
    sensor = scene.sensor
    dark_e2 = sensor.read_noise_e**2 + sensor.gain_e_per_dn**2 / 12
    noise_e = 2 * np.sqrt((brightness_e / 2 + dark_e2) / sequence.takes)
    lit = (brightness_e > 0) | (np.abs(found) > 0).any(axis=0)
    apart = (np.abs(found - expected) / noise_e)[:, lit]
    own = (spread / noise_e)[:, lit]
    shift_rad = np.angle(found[0] * np.conj(expected[0]))[lit]
    mm = 1e3 * 299_792_458.0 / (4 * np.pi * sequence.base_frequency_hz)
    missing = world.explain(scene.name, sequence).not_made
    return Verdict(
        scene.name,
        sequence_name,
        float(np.sqrt(np.mean(apart**2))),
        float(np.sqrt(np.mean(own**2))),
        float(apart.max(initial=0.0)),
        float(np.mean((apart > 0.5 + _CERTAIN * own).any(axis=0))),
        float(np.median(np.abs(shift_rad)) * mm),
        tuple(f"{each.effect} {each.relative:.1f}" for each in missing if each.called_for),
    )


def _moments(
    sequence: Sequence, period_s: float, image: Callable[[ImageLabel, float], Values]
) -> NDArray[np.complex128]:
    """Moments (m, ...) in electrons from the four images of each harmonic in the first take."""
    by_harmonic: dict[int, list[Values]] = {}
    for label in sequence.labels:
        if label.take == 0 and label.harmonic > 0:
            taken = image(label, START_S + label.index * period_s)
            by_harmonic.setdefault(label.harmonic, []).append(taken)
    return np.array([(a - c) + 1j * (b - d) for a, b, c, d in by_harmonic.values()])


def tables(
    *,
    scenes: tuple[Path, ...] = (),
    sequences: tuple[str, ...] = ("video",),
    pixels: int = 64,
    paths: int = 4096,
    unlimited: bool = False,
) -> Iterator[Table]:
    """Judge built-in scenes and harder ones, or files and folders of ``scenes``.

    ``paths`` are those of one of 8 repetitions in one of so many ``pixels``. ``unlimited`` follows
    light further than a file's [transport] says.
    """
    names = [
        str(file)
        for path in scenes
        for file in (sorted(path.glob("*.toml")) if path.is_dir() else [path])
    ]
    table = Table(
        "",
        heads(
            "scene | sequence | simulation - tracer, rms:.2f | tracer's own error:.2f | largest:.1f"
            " | beyond half the noise:.1% | range, median mm:.2f | said to be missing"
        ),
    )
    for name in names or (*BUILT_IN, *unseen()):
        scene = scene_named(name)
        if scene.camera is None:
            continue
        by = told(scene, sequences, pixels=pixels, paths=paths, as_stated=not unlimited)
        for sequence in sequences:
            each = judge(scene, sequence, by)
            table.rows.append((*each[:-1], ", ".join(each.missing) or "-"))
    yield table
