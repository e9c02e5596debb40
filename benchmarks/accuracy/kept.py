"""What was measured of plans, and how the page of plans states it."""

from dataclasses import dataclass

import numpy as np

from benchmarks.common.tables import Cell, Table, heads
from transientcam_server.planning import SHARE


@dataclass(frozen=True)
class PlanOutcome:
    """A plan and what was measured of it; errors in m, None where a goal was refused."""

    scene: str
    goal: str
    target_m: float | None
    choice: str
    capture_s: float
    device_s: float
    predicted: dict[str, float]
    interval: tuple[float, float]
    measured: dict[str, float]
    saturated: float
    planned_in_s: float
    bias_known: bool

    @property
    def ratios(self) -> dict[str, float]:
        """Measured over predicted noise, bias and error; a predicted bias of 0 counts as 1 µm."""
        return {
            name: self.measured[name] / max(self.predicted[name], 1e-6)
            for name in ("std", "bias", "within")
        }

    @property
    def below(self) -> bool:
        """Whether the error that was measured is less than its interval."""
        return self.measured["within"] < self.interval[0]

    @property
    def above(self) -> bool:
        """Whether it is more."""
        return self.measured["within"] > self.interval[1]

    @property
    def covered(self) -> bool:
        """Whether the interval of the error holds what was measured."""
        return not self.below and not self.above

    @property
    def met(self) -> bool | None:
        """Whether the target was met in `SHARE` of the pixels; None without one."""
        return None if self.target_m is None else self.measured["share"] >= SHARE

    def row(self) -> tuple[Cell, ...]:
        """Return what the table says of it, in mm."""
        p, q = self.predicted, self.measured
        low, high = (1e3 * end for end in self.interval)
        return (
            self.scene,
            self.goal,
            self.choice,
            1e3 * self.capture_s,
            f"{1e3 * p['std']:.3g}, {1e3 * q['std']:.3g}",
            f"{1e3 * p['bias']:.3g}, {1e3 * q['bias']:.3g}",
            f"{1e3 * p['within']:.3g} ({low:.3g} to {high:.3g})",
            1e3 * q["within"],
            self.ratios["within"],
            None if self.target_m is None else f"{p['share']:.2f}, {q['share']:.2f}",
            {None: None, True: "yes", False: "no"}[self.met],
        )


@dataclass(frozen=True)
class Refused:
    """A goal that is out of reach, or may be, and why."""

    scene: str
    goal: str
    why: str
    decided: bool = True


OF_WAYS = heads(
    "device | plans | targets met | intervals that hold | below | above | width of known:.2f | "
    "measured / predicted: 10 %, 50 %, 90 % | refused | time off:.2%"
)
"""The columns of `of_way`."""


def of_way(name: str, rows: list[PlanOutcome], refused: list[Refused]) -> tuple[Cell, ...]:
    """State in a row what to expect of plans before a device.

    The width of an interval is its upper end over its lower one: the median of those whose bias is
    said to be known.
    """
    targets = [row.met for row in rows if row.met is not None]
    widths = [row.interval[1] / row.interval[0] for row in rows if row.bias_known]
    ratios = [row.ratios["within"] for row in rows]
    said = ", ".join(f"{each:.2f}" for each in np.quantile(ratios, (0.1, 0.5, 0.9))) if rows else ""
    decided = sum(each.decided for each in refused)
    return (
        name,
        len(rows),
        f"{sum(targets)} of {len(targets)}",
        sum(row.covered for row in rows),
        sum(row.below for row in rows),
        sum(row.above for row in rows),
        float(np.median(widths)) if widths else None,
        said,
        f"{decided}, {len(refused) - decided} undecided",
        max((abs(row.device_s / row.capture_s - 1) for row in rows), default=None),
    )


def table(name: str, rows: list[PlanOutcome], refused: list[Refused]) -> Table:
    """Return all plans, and what was refused."""
    columns = heads(
        "scene | goal | recommended | ms:.0f | noise | bias | 90 % within mm (interval) | "
        "measured:.3g | ratio:.2f | share within the target | met"
    )
    said = [f"- refused: {each.scene}, {each.goal}: {each.why}" for each in refused]
    notes = ["Noise, bias and share: predicted, measured; noise and bias of the median pixel, mm."]
    return Table(f"Plans: {name}", columns, [row.row() for row in rows], said, notes)
