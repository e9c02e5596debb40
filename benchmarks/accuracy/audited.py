"""The worst cases of an audit of planning, before, and what is measured of the same goals now.

The audit was of commit 3a88b57; its figures are cited, and not measured again.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from benchmarks.accuracy.kept import Kept, Refused


@dataclass(frozen=True)
class Before:
    """What the audit found; errors in m."""

    scene: str
    goal: str
    plan: str
    capture_s: float
    predicted_m: float
    measured_m: float


WORST: Final = (
    Before("corner2", "5 mm", "m = 1", 0.042, 4.60e-3, 31e-3),
    Before("corner2", "0.2 s", "m = 1", 0.179, 2.05e-3, 29e-3),
    Before("glossy", "5 mm", "m = 1", 0.027, 4.70e-3, 40e-3),
    Before("glossy", "0.2 s", "m = 1", 0.181, 1.66e-3, 40e-3),
    Before("translucent", "5 mm", "m = 1, 1.35 ms x 2", 0.041, 4.48e-3, 10.1e-3),
    Before("darkfar", "20 mm", "m = 1, 4.06 ms", 0.031, 18.4e-3, 6.517),
    Before("darkfar", "5 mm", "m = 4, 11.1 ms", 0.237, 4.54e-3, 6.517),
    Before("object", "0.2 s", "m = 6, 3.27 ms", 0.168, 202.1e-3, 1.18e-3),
    Before("sunny", "5 mm", "m = 3, 2.37 ms", 0.073, 4.93e-3, 9.59e-3),
    Before("sunny", "0.2 s", "m = 5, 4.8 ms, saturated", 0.171, 2.22e-3, 5.86e-3),
    Before("corner", "5 mm", "m = 6, 2 ms x 16", 2.2, 4.72e-3, 5.54e-3),
)
"""By scene and goal: of the plan the figure shown, a deviation, and the larger one of measured
deviation and median error."""


def table(kept: Iterable[Kept], refused: Iterable[Refused]) -> str:
    """Return before and after, of the cases that were measured."""
    now = {(each.scene, each.goal): each for each in kept}
    why = {(each.scene, each.goal): each.why for each in refused}
    lines = [
        "Before: the planner that the audit of commit 3a88b57 found, cited from it: the deviation "
        "that it showed, and the larger one of measured deviation and median error. After: error "
        "(noise and bias) predicted and measured.",
        "",
        "| scene | goal | before: plan | ms | shown mm | measured mm "
        "| after: plan | ms | predicted mm | measured mm |",
        "|---" * 10 + "|",
    ]
    for case in WORST:
        place = case.scene, case.goal
        if place not in now and place not in why:
            continue
        after = f"refused: {why.get(place)} | | | "
        if place in now:
            row = now[place]
            after = (
                f"{row.choice} | {row.capture_s * 1e3:.0f} | {row.predicted['error'] * 1e3:.3g} "
                f"| {row.measured['error'] * 1e3:.3g}"
            )
        lines.append(
            f"| {case.scene} | {case.goal} | {case.plan} | {case.capture_s * 1e3:.0f} "
            f"| {case.predicted_m * 1e3:.3g} | {case.measured_m * 1e3:.3g} | {after} |"
        )
    return "\n".join(lines)
