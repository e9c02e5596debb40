"""What the automatic choice leaves out: against everything, and against nothing.

Moments are compared before noise, in units of the noise of one moment of the pixel concerned, with
all effects that the scene has anything for and with none; `judge` holds the same automatic choice
against light that is followed independently.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.common.tables import Table, heads
from benchmarks.simulation.scenes import (
    BUILT_IN,
    READOUT_S,
    START_S,
    scene_named,
    unseen,
    world_before,
)
from transientcam_driver import Sequence
from transientcam_driver.sequence import ImageLabel
from transientcam_simulation.imaging import World

SEQUENCES = {
    "video": Sequence(harmonics=3, zeroth="estimated", exposure_s=0.0005),
    "m = 4 x 20": Sequence(harmonics=4, takes=20),
    "m = 6 x 8": Sequence(harmonics=6, takes=8),
}
OF_LIGHT = (
    "distortion",
    "mirror-paths",
    "glass",
    "gloss",
    "interreflection",
    "scattering",
    "mixed-pixels",
)
OF_IMAGES = (*OF_LIGHT, "motion")

Moments = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Difference:
    """Of moments from others, over the lit pixels, in units of the noise."""

    rms: float
    largest: float
    beyond_half: float


@dataclass(frozen=True, slots=True)
class Accuracy:
    """What a scene's automatic choice leaves out at a sequence."""

    scene: str
    sequence: str
    called: tuple[str, ...]
    everything: Difference
    nothing: Difference


def measure(name: str, sequence_name: str) -> Accuracy:
    """Compare moments of the automatic choice with those of everything, nothing, and many rays."""
    scene, sequence = scene_named(name), SEQUENCES[sequence_name]
    automatic = world_before(scene, {}, sequence)
    there = tuple(
        effect
        for effect in OF_IMAGES
        if effect != "interreflection" or scene.transport.diffuse_bounces != 0
        if effect != "distortion" or (scene.camera is not None and scene.camera.lens.bends)
    )
    everything, nothing = (
        world_before(scene, dict.fromkeys(there, choice), sequence) for choice in ("on", "off")
    )
    found = _moments(automatic, sequence)
    brightness = automatic.truth(device_time_s=START_S).brightness.ravel()
    gain_e = sequence.exposure_s * scene.light.electrons_per_s / automatic.sensor.gain_e_per_dn
    conditions = automatic.conditions(sequence)
    noise = replace(conditions.noise, white_e=conditions.white_e)
    deviation_e = noise.deviation(brightness / gain_e, 1.0) * noise.scale_e
    lit = brightness > 0
    explained = automatic.explain(name, sequence)
    return Accuracy(
        name,
        sequence_name,
        tuple(each.effect for each in explained.effects if each.built and each.choice == "auto"),
        _difference(found - _moments(everything, sequence), deviation_e, lit),
        _difference(found - _moments(nothing, sequence), deviation_e, lit),
    )


def _moments(world: World, sequence: Sequence) -> Moments:
    """Moments (m, P) in electrons of the first, the middle and the last take."""
    period_s = sequence.exposure_s + READOUT_S

    def image(label: ImageLabel) -> NDArray[np.float64]:
        time_s = START_S + label.index * period_s
        mean_e = world.mean_image_e(label, number=label.index, device_time_s=time_s)
        return mean_e.ravel().astype(np.float64)

    return four_buckets(sequence, image)


def four_buckets(sequence: Sequence, image: Callable[[ImageLabel], NDArray[np.float64]]) -> Moments:
    """Return moments (m, P) of the first, the middle and the last take, as means over these."""
    takes = sorted({0, sequence.takes // 2, sequence.takes - 1})
    moments: list[Moments] = []
    for j in range(1, sequence.harmonics + 1):
        total = np.zeros(0, dtype=np.complex128)
        for take in takes:
            of = [each for each in sequence.labels if each.take == take and each.harmonic == j]
            i_0, i_90, i_180, i_270 = map(image, of)
            moment = (i_0 - i_180) + 1j * (i_90 - i_270)
            total = total + moment if total.size else moment
        moments.append(total / len(takes))
    return np.array(moments)


def _difference(
    apart_e: Moments, deviation_e: NDArray[np.float64], lit: NDArray[np.bool_]
) -> Difference:
    relative = (np.abs(apart_e) / deviation_e)[:, lit]
    worst = relative.max(axis=0)
    return Difference(
        float(np.sqrt(np.mean(relative**2))), float(worst.max()), float(np.mean(worst > 0.5))
    )


def tables(*, small: bool = False) -> Iterator[Table]:
    """Compare all scenes with each sequence; ``small``: only with that of video."""
    columns = heads("scene | sequence | called for | automatic - everything | automatic - nothing")
    table = Table("", columns)
    for name in (*BUILT_IN, *unseen()):
        for sequence in list(SEQUENCES)[: 1 if small else None]:
            each = measure(name, sequence)
            called = ", ".join(_of_scene(each.called))
            others = _words(each.everything), _words(each.nothing)
            table.rows.append((each.scene, each.sequence, called, *others))
    yield table


def _of_scene(called: tuple[str, ...]) -> list[str]:
    always = ("shot-noise", "read-noise", "quantisation")
    return [each for each in called if each not in always] or ["-"]


def _words(each: Difference) -> str:
    return f"{each.rms:.2f}, {each.largest:.1f}, {each.beyond_half:.2%}"
