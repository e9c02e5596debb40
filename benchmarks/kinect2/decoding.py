"""How the decoder differs from libfreenect2's, and how fast it is."""

from collections.abc import Iterator
from typing import Final

import numpy as np

import transientcam_moments as tm
from benchmarks.common.tables import Cell, Table, verdict
from benchmarks.common.timing import duration, measure
from tests.driver.cameras.kinect2 import libfreenect2
from tests.driver.cameras.kinect2.vectors import (
    MULTIPLES,
    RADIAN_M,
    Array,
    Scene,
    folder,
    load,
    noise,
)
from transientcam_driver.cameras.kinect2 import SUB_IMAGES, Assembler, Rows, codes, encoder

SCENES: Final = ("ramp", "noisy", "two_returns")
NOISY_STD: Final = 4.0
"""Of the samples of the scene `noisy`, as its description says."""
ROUNDING: Final = 0.29
"""Standard deviation of a sample that is rounded to whole counts."""
TOO_LONG: Final = libfreenect2.SPEED_OF_LIGHT_M_S / tm.SPEED_OF_LIGHT_M_S
"""libfreenect2 takes the speed of light for 300 000 km/s."""
ERRORS: Final = "median error, mm:.1f | 90 %, mm:.1f | mean, mm:+.1f | without a range:.2%"
"""Heads of what `errors` returns."""
_VARIANTS: Final[dict[str, Rows]] = {"off": "bottom", "off_tables_flipped": "top"}


def tables() -> Iterator[Table]:
    """Compare with libfreenect2's outputs, and time the way to moments."""
    yield differences()
    yield speed()


def errors(off_m: Array) -> tuple[Cell, ...]:
    """Return how far ranges are off, NaN where there is none, as columns have it."""
    there = np.isfinite(off_m)
    off_mm = 1e3 * off_m[there]
    median_mm, most_mm = np.percentile(np.abs(off_mm), (50, 90))
    return median_mm, most_mm, off_mm.mean(), 1 - there.mean()


def infrared(scene: Scene) -> float:
    """Return the largest difference of the infrared image from libfreenect2's, of 65 535."""
    light = np.where(scene.saturated, 65_535.0, np.abs(scene.moments)).sum(axis=0)
    shown = np.minimum(16 / 3 * light, 65_535)
    return float(np.abs(shown - scene.stored["ir_off"]).max())


def differences() -> Table:
    """Compare infrared and depth of all scenes with one return."""
    columns = ("scene, rows of the tables", "IR", "median", "95 %", "error here", "libfreenect2's")
    made = Table("Difference from libfreenect2, its filters off", columns)
    for name in ("ramp", "noisy"):
        scene = load(name)
        std = ROUNDING if name == "ramp" else NOISY_STD
        found = tm.unwrap(scene.moments, noise(std), harmonics=MULTIPLES)
        path_m = 2 * RADIAN_M * np.asarray(found.phase_rad)
        for variant, rows in _VARIANTS.items():
            theirs_mm = scene.stored.get(f"depth_mm_{variant}")
            if theirs_mm is None:
                continue
            true_mm = scene.z_mm(scene.path_m, rows)
            ours_mm = scene.z_mm(path_m, rows)
            both = (theirs_mm > 0) & (np.abs(theirs_mm / TOO_LONG - true_mm) < 50)
            apart = np.abs(ours_mm - theirs_mm / TOO_LONG)[both]
            off = [np.abs(each - true_mm)[both] for each in (ours_mm, theirs_mm)]
            made.rows.append(
                (
                    f"{name}, from the {rows}",
                    f"{infrared(scene):.3f}",
                    f"{np.median(apart):.2f} mm",
                    f"{np.percentile(apart, 95):.2f} mm",
                    *(f"{np.median(each):.2f} mm" for each in off),
                )
            )
    made.notes.append(
        "IR: largest difference of the infrared image, whose values go to 65 535; that of "
        f"`two_returns` is {infrared(load('two_returns')):.3f}. Median and 95 %: difference of "
        "depths z, with libfreenect2's divided by 1.00069, since it takes the speed of light for "
        "300 000 km/s. Errors are medians against the truth, libfreenect2's as it gives them. Only "
        "pixels count where libfreenect2 has a depth, and the right period. Phases are weighted by "
        "frequency and amplitude here, and depth is the exact intersection of ray and ellipsoid; "
        "libfreenect2 adds three phases with equal weights, and its geometry is to first order."
    )
    made.notes.append(_restated())
    return made


def _restated() -> str:
    """Say how far `tests.driver.cameras.kinect2.libfreenect2` is from libfreenect2 itself."""
    found = [libfreenect2.agreement(load(name)) for name in SCENES]
    same, apart_mm = (min(each[0] for each in found), max(each[1] for each in found))
    return (
        "Where this page has libfreenect2 on other frames than these, it is its arithmetic stated "
        f"anew: on all three scenes void in the same pixels ({same:.2%} of them), and its depths "
        f"within {apart_mm:.2f} mm of the stored ones."
    )


def speed() -> Table:
    """Time the way from packets to moments."""
    with np.load(folder() / "ramp.npz") as archive:
        data = archive["packet"].reshape((SUB_IMAGES, -1))
    packets = list(encoder.packets(data, sequence=1, timestamp=1))

    def assembled() -> None:
        assembler = Assembler()
        for packet in packets:
            assembler.push(packet)

    steps = {
        "packets to sub-images": measure(assembled).best_s,
        "sub-images to images": measure(lambda: codes.frame_images(data[:-1])).best_s,
    }
    steps["both"] = sum(steps.values())
    made = Table("Decoding a frame, on one core", ("step", "time", "frames a second"))
    for name, best_s in steps.items():
        made.rows.append((name, duration(best_s), f"{1 / best_s:.0f}"))
    made.notes.append("The fastest of many repetitions.")
    made.notes.append(verdict(1 / steps["both"], 30, "30 frames a second on one core"))
    return made
