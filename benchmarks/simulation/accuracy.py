"""What the automatic choice leaves out: against everything, and against many rays a pixel.

Moments are compared before noise, in units of the noise of one moment of the pixel concerned. The
reference follows rays at every image's own time, with all effects that the scene has anything for;
where something moves, in some of the pixels, drawn once.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from benchmarks.common.tables import Table, heads
from benchmarks.simulation.reference import FINE_MOVING, FINE_STILL, reference_moments
from benchmarks.simulation.scenes import BUILT_IN, scene_named, unseen
from transientcam_driver import Sequence
from transientcam_driver.sequence import ImageLabel
from transientcam_simulation.emulated import world_of
from transientcam_simulation.imaging import World
from transientcam_simulation.scene import Scene

READOUT_S = 3.98e-3
START_S = 9.0  # a visitor is there
SIZE = 163, 120
DRAWN = 1500  # pixels of moving scenes that are held against the reference
_FINER_IN = 4  # so many times as many rays, in one in so many of these pixels
SEQUENCES = {
    "video": Sequence(harmonics=3, zeroth="estimated", exposure_s=0.0005),
    "m = 4 x 20": Sequence(harmonics=4, takes=20),
    "m = 6 x 8": Sequence(harmonics=6, takes=8),
}
OF_LIGHT = ("distortion", "mirror-paths", "gloss", "interreflection", "scattering", "mixed-pixels")
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
    rays: Difference | None
    finer_rays: Difference | None


def measure(name: str, sequence_name: str) -> Accuracy:
    """Compare moments of the automatic choice with those of everything, nothing, and many rays."""
    scene, sequence = scene_named(name), SEQUENCES[sequence_name]
    automatic = _world(scene, scene.effects, sequence)
    there = tuple(
        effect
        for effect in OF_IMAGES
        if effect != "interreflection" or scene.transport.diffuse_bounces != 0
        if effect != "distortion" or (scene.camera is not None and scene.camera.lens.bends)
    )
    everything, nothing = (
        _world(scene, scene.effects | dict.fromkeys(there, choice), sequence)
        for choice in ("on", "off")
    )
    found = _moments(automatic, sequence)
    pixel = np.arange(SIZE[0] * SIZE[1])
    if scene.moves:
        pixel = np.sort(np.random.default_rng(1).choice(pixel, DRAWN, replace=False))
    fine = FINE_MOVING if scene.moves else FINE_STILL
    reference = _reference(scene, automatic, sequence, pixel, fine=fine)
    finer = None
    if scene.moves:
        finer = _reference(scene, automatic, sequence, pixel[::_FINER_IN], fine=_FINER_IN * fine)
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
        None
        if reference is None
        else _difference(found[:, pixel] - reference, deviation_e[pixel], lit[pixel]),
        None
        if reference is None or finer is None
        else _difference(
            reference[:, ::_FINER_IN] - finer,
            deviation_e[pixel[::_FINER_IN]],
            lit[pixel[::_FINER_IN]],
        ),
    )


def _world(scene: Scene, effects: dict[str, str], sequence: Sequence) -> World:
    changed = replace(scene, effects=effects)
    world = world_of(changed, width=SIZE[0], height=SIZE[1], readout_s=READOUT_S)
    world.configure(sequence, sequence.labels)
    return world


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


def _reference(
    scene: Scene, world: World, sequence: Sequence, pixel: NDArray[np.intp], *, fine: int
) -> Moments | None:
    """Moments of some pixels by many rays in each image; None for scenes without geometry."""
    if scene.camera is None or scene.device.name != "ideal":
        return None
    conditions = world.conditions(sequence)
    cosine = conditions.cosine.ravel()[pixel] ** scene.camera.lens.vignetting
    scale_e = 0.5 * scene.light.electrons_per_s * sequence.exposure_s
    period_s = sequence.exposure_s + READOUT_S
    frequencies_hz = tuple(sorted({0.0, *(label.frequency_hz for label in sequence.labels)}))

    @cache
    def moments_at(time_s: float, frequencies_hz: tuple[float, ...]) -> Moments:
        return reference_moments(scene.at(time_s), pixel, SIZE, frequencies_hz, fine=fine)

    def image(label: ImageLabel) -> NDArray[np.float64]:
        time_s, asked_hz = 0.0, frequencies_hz
        if scene.moves:
            time_s, asked_hz = START_S + label.index * period_s, (0.0, label.frequency_hz)
        moments = moments_at(time_s, asked_hz)
        modulated = moments[asked_hz.index(label.frequency_hz)]
        turned = modulated * conditions.sub_phase_gain(1) * np.exp(-1j * label.phase_rad)
        electrons: NDArray[np.float64] = scale_e * cosine * (moments[0] + turned).real
        return electrons  # but for other light, which cancels

    return four_buckets(sequence, image)


def tables(*, small: bool = False) -> Iterator[Table]:
    """Compare all scenes with each sequence; ``small``: only with that of video."""
    columns = heads(
        "scene | sequence | called for | automatic - everything | automatic - nothing | "
        "automatic - rays | rays - more rays"
    )
    table = Table("", columns)
    for name in (*BUILT_IN, *unseen()):
        for sequence in list(SEQUENCES)[: 1 if small else None]:
            each = measure(name, sequence)
            others = (each.everything, each.nothing, each.rays, each.finer_rays)
            called = ", ".join(_of_scene(each.called))
            table.rows.append((each.scene, each.sequence, called, *map(_words, others)))
    yield table


def _of_scene(called: tuple[str, ...]) -> list[str]:
    always = ("shot-noise", "read-noise", "quantisation")
    return [each for each in called if each not in always] or ["-"]


def _words(each: Difference | None) -> str:
    if each is None:
        return "-"
    return f"{each.rms:.2f}, {each.largest:.1f}, {each.beyond_half:.2%}"
