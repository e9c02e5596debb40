"""What the service says of calibrations measured on diffusors and on scenes."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.common.measured_scenes import data_folder
from benchmarks.common.tables import Table, heads
from transientcam_driver import CalibrationCapture, Sequence
from transientcam_server.imaging import Calibration, Verdict, evaluate, judge
from transientcam_simulation import find_scene, list_scenes, measured_scene
from transientcam_simulation.base import IDEAL, Pattern
from transientcam_simulation.base._imperfections import PROTOTYPE
from transientcam_simulation.emulated import world_of
from transientcam_simulation.scene import Scene

TAKES: Final = 6
HEIGHT, WIDTH = 120, 163
FULL_SCALE_DN: Final = 65535.0
SEQUENCE: Final = Sequence(harmonics=4, zeroth="estimated")
READOUT_S: Final = 1.85e-3
_Array = NDArray[Any]
Spoil = Callable[[_Array, np.random.Generator], _Array]
"""Changes the images (takes, N, H, W) of a measurement, floating point, in DN."""


@dataclass(frozen=True)
class Case:
    """A measurement, and whether it should be trusted."""

    name: str
    scene: Scene
    trusted: bool
    sequence: Sequence = SEQUENCE
    spoil: Spoil | None = None
    before: Scene | None = None
    """A diffusor that the camera was calibrated with before."""


def capture(case: Case, scene: Scene) -> CalibrationCapture:
    """Measure with a simulated camera, image by image."""
    sequence = replace(case.sequence, takes=1)
    world = world_of(scene, width=WIDTH, height=HEIGHT, readout_s=READOUT_S)
    world.configure(sequence, sequence.labels)
    period_s = sequence.exposure_s + READOUT_S
    shots = iter(range(TAKES * (len(sequence.labels) + 1)))

    def image(label: Any) -> _Array:
        number = next(shots)
        return np.asarray(
            world.image(label, number=number, device_time_s=number * period_s), np.float32
        )

    takes = np.stack([[image(label) for label in sequence.labels] for _ in range(TAKES)])
    dark_label = replace(sequence.labels[0], illumination=False, frequency_hz=0.0)
    dark = np.stack([image(dark_label) for _ in range(TAKES)])
    if case.spoil is not None:
        both = np.concatenate([takes, dark[:, None]], axis=1)
        both = case.spoil(both, np.random.default_rng(7))
        takes, dark = both[:, :-1], both[:, -1]
    averaged, kept = tm.average_takes(np.clip(np.round(takes), 0, FULL_SCALE_DN).astype(np.uint16))
    return CalibrationCapture(
        images=np.asarray(averaged, np.float32),
        kept=np.asarray(kept),
        sequence=sequence,
        low_frequency_hz=0.9e6,
        serial="SIM",
        model="simulated",
        firmware="",
        temperature_c=25.0,
        captured_unix_s=0.0,
        dark=dark.mean(axis=0),
        dark_deviation=dark.std(axis=0, ddof=1),
    )


def verdict(case: Case) -> Verdict:
    """Measure a case and judge it as the service does."""
    reference: Calibration | None = None
    if case.before is not None:
        reference = evaluate(capture(replace(case, spoil=None), case.before))
    measured = capture(case, case.scene)
    bad = evaluate(measured).gains.bad
    return judge(measured, bad, full_scale=FULL_SCALE_DN, reference=reference)


def vignetting(images: _Array, _: np.random.Generator) -> _Array:
    """Leave a quarter of the light in the corners."""
    y, x = np.meshgrid(np.linspace(-1, 1, HEIGHT), np.linspace(-1, 1, WIDTH), indexing="ij")
    return _dimmed(images, 1 - 0.375 * (x**2 + y**2))


def dirt(images: _Array, random: np.random.Generator) -> _Array:
    """Put 40 grains on the diffusor that let through 3 to 60 % of the light."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    passed = np.ones((HEIGHT, WIDTH))
    for _ in range(40):
        row, column, radius = random.uniform((0, 0, 1), (HEIGHT, WIDTH, 6))
        inside = (y - row) ** 2 + (x - column) ** 2 < radius**2
        passed[inside] = random.uniform(0.03, 0.6)
    return _dimmed(images, passed)


def bad_pixels(images: _Array, random: np.random.Generator) -> _Array:
    """Make 5 % of the pixels dead, hot, noisy or stuck."""
    spoiled = images.copy()
    kind = random.choice(5, size=(HEIGHT, WIDTH), p=(0.95, 0.0125, 0.0125, 0.0125, 0.0125))
    black = np.median(images[:, -1])
    spoiled[..., kind == 1] = black
    spoiled[..., kind == 2] += 5000.0
    noise = 2000.0 * random.standard_normal(images.shape)
    spoiled[..., kind == 3] += noise[..., kind == 3]
    spoiled[..., kind == 4] = FULL_SCALE_DN
    return spoiled


def everything(images: _Array, random: np.random.Generator) -> _Array:
    """Spoil in every way."""
    return bad_pixels(dirt(vignetting(images, random), random), random)


def too_bright(images: _Array, _: np.random.Generator) -> _Array:
    """Let forty times the light saturate the sensor where it is brightest."""
    black = np.median(images[:, -1])
    return np.asarray(np.minimum(black + 40 * (images - black), FULL_SCALE_DN))


def _dimmed(images: _Array, passed: _Array) -> _Array:
    black = np.median(images[:, -1])
    return np.asarray(black + (images - black) * passed)


def diffusor_scene(**changes: Any) -> Scene:
    """Return the built-in calibration scene with changes of it."""
    return replace(find_scene("calibration"), **changes)


def diffusors(data: Path) -> Iterator[Case]:
    """Yield what should be trusted, and what a diffusor alone cannot show."""
    real = diffusor_scene(device=PROTOTYPE)
    for zeroth in ("low-frequency", "on-off", "estimated"):
        for m in (1, 3, 4, 8):
            sequence = replace(SEQUENCE, harmonics=m, zeroth=zeroth)
            yield Case(f"diffusor, m = {m}, {zeroth}", real, True, sequence)
    fast = replace(SEQUENCE, base_frequency_hz=46e6, harmonics=2)
    yield Case("diffusor, 46 MHz", real, True, fast)
    yield Case("diffusor, an ideal camera", diffusor_scene(), True)
    for spoil, words in (
        (vignetting, "a quarter of the light in the corners"),
        (dirt, "40 grains of dirt"),
        (bad_pixels, "5 % bad pixels"),
        (everything, "vignetting, dirt and 5 % bad pixels"),
    ):
        yield Case(f"diffusor, {words}", real, True, spoil=spoil)
    dim = replace(real, light=replace(real.light, electrons_per_s=2.5e5))
    yield Case("diffusor, a fiftieth of the light", dim, True)
    late = replace(PROTOTYPE.drift, delay_s_per_c=4e-11, time_constant_s=0.2)  # type: ignore[type-var]
    drifting = diffusor_scene(device=replace(PROTOTYPE, drift=late))
    yield Case("diffusor, ten times the drift while it is measured", drifting, True)
    board = data / "modulation" / "TintinCDKCameraPhaseOffset.bin"
    if board.is_file():
        measured = replace(PROTOTYPE, pattern=Pattern(gain=0.01, file=board))
        yield Case("diffusor, phases of a real board", diffusor_scene(device=measured), True)
        yield Case(
            "diffusor, phases of a real board, spoiled in every way",
            diffusor_scene(device=measured),
            True,
            spoil=everything,
        )
    delayed = diffusor_scene(device=PROTOTYPE, diffusor=_delayed(3e-9))
    yield Case("diffusor, electronics 3 ns late, nothing known before", delayed, False)
    yield Case("the same, its delay known from before", delayed, True, before=delayed)
    yield Case("diffusor, saturated", real, False, spoil=too_bright)
    none = replace(real, light=replace(real.light, electrons_per_s=1.0))
    yield Case("no light", none, False)


def _delayed(delay_s: float) -> Any:
    diffusor = find_scene("calibration").diffusor
    assert diffusor is not None
    return replace(diffusor, delay_s=delay_s)


def scenes(data: Path) -> Iterator[Case]:
    """Yield every scene there is; none should be trusted."""
    before = diffusor_scene(device=PROTOTYPE)
    for info in list_scenes():
        if info.name in ("calibration", "measured"):
            continue
        for device in (IDEAL, PROTOTYPE):
            scene = replace(find_scene(info.name), device=device)
            for sequence in (SEQUENCE, Sequence()):
                mode = f"m = {sequence.harmonics}, {sequence.zeroth}"
                yield Case(f"{info.name}, {device.name}, {mode}", scene, False, sequence)
        known = f"{info.name}, prototype, calibrated before"
        yield Case(known, replace(find_scene(info.name), device=PROTOTYPE), False, before=before)
    for path in sorted((data / "scenes").glob("*.toml")):
        yield Case(path.name, replace(find_scene(str(path)), device=PROTOTYPE), False)
    for name in (
        "measured/scene_letter_s.npz",
        "measured/capture_1_0_inch.npz",
        "measured/capture_3_0_inch.npz",
        "rendered/mitransient_cornell_163x120x300.npz",
    ):
        if (data / name).is_file():
            scene = measured_scene(data / name, background="median", time_zero="start")
            yield Case(Path(name).stem, scene, False)


def tables() -> Iterator[Table]:
    """Judge everything; measured scenes and phases are in the folder TRANSIENTCAM_TEST_DATA."""
    data = data_folder() or Path()
    yield _table("Diffusors", diffusors(data))
    yield _table("Scenes", scenes(data))


def _table(title: str, cases: Iterator[Case]) -> Table:
    columns = heads(
        "measured on | verdict | unlike:.1% | not judged:.1% | residual, m:.3f | "
        "harmonics, rad:.2f | magnitudes:.2f | field, m:.3f | offset, m:+.3f | right"
    )
    found = Table(title, columns)
    wrong = 0
    for case in cases:
        given = verdict(case)
        values = {each.test: each.value for each in given.findings}
        right = given.trusted == case.trusted
        wrong += not right
        shown = [values[name] for name in _SHOWN]
        found.rows.append((case.name, given.word, *shown, "yes" if right else "**no**"))
        print(case.name, given.word, "" if right else "WRONG", flush=True)
    found.notes.append(f"{wrong} of {len(found.rows)} verdicts are wrong.")
    return found


_SHOWN: Final = (
    "unlike_share",
    "unknown_share",
    "residual_m",
    "harmonic_phase_rad",
    "magnitude_share",
    "field_m",
    "offset_m",
)
