"""Points of the corner, seen from above: the same capture of one take by several estimators."""

from pathlib import Path
from typing import Any, Final

from benchmarks.likelihood.errors import ESTIMATORS, captured, errors_of, ranges, turn_m
from transientcam_driver import Sequence
from transientcam_experiments.paper import style
from transientcam_experiments.paper.bench import Bench
from transientcam_server.imaging import Intrinsics

FIGURE: Final = "corner-points.png"
SEQUENCE: Final = Sequence(base_frequency_hz=23e6, harmonics=4, takes=1)
SHOWN: Final = ("single-frequency", "pisarenko", "maximum-entropy", "likelihood")
FIELD_DEG: Final = 40.0
ROWS: Final = slice(40, 80)
"""Near the middle, where the walls are seen from above as lines."""


def draw(figures: Path) -> None:
    """Draw corner-points.png, and say how far the points are off."""
    shot, gains, settings, truth = captured(Bench(seed=1), "corner", SEQUENCE)
    found = ranges(shot.found.measured, settings, calibration=gains)
    lens = Intrinsics.of_field(FIELD_DEG, width=truth.shape[1], height=truth.shape[0])
    true, middle = lens.points(truth), truth.shape[0] // 2
    with style.new(11.0, 3.2) as picture:
        panels: Any = picture.subplots(1, len(SHOWN), sharex=True, sharey=True)
        for axes, name in zip(panels, SHOWN, strict=True):
            errors = errors_of(found[name], truth, turn_m(shot.base_frequency_hz))
            x, _, z = (part[ROWS].ravel() for part in lens.points(found[name]))
            axes.plot(x, z, ".", color=style.OURS, markersize=1.2, alpha=0.5)
            axes.plot(true[0, middle], true[2, middle], color="black", linewidth=0.8)
            label = ESTIMATORS[name]
            axes.set(title=f"{label}\n{errors.median_mm:.0f} mm, 90 % below {errors.p90_mm:.0f} mm")
            axes.set(xlabel="x / m", xlim=(-0.75, 0.75), ylim=(1.5, 2.75), xticks=(-0.5, 0, 0.5))
            print(f"{label}: median / 90 % / RMSE / bias, mm: {errors}")
        panels[0].set(ylabel="depth / m")
        (figures / FIGURE).write_bytes(style.png(picture))
    print(f"{FIGURE}: one take of {1e3 * shot.applied.capture_s:.0f} ms")
