"""What was measured of plans, and how the page of plans states it."""

from dataclasses import dataclass

import numpy as np

from benchmarks.common.tables import Cell, Table, heads


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
            for name in ("std", "bias", "error")
        }

    @property
    def below(self) -> bool:
        """Whether the error that was measured is less than its interval."""
        return self.measured["error"] < self.interval[0]

    @property
    def above(self) -> bool:
        """Whether it is more."""
        return self.measured["error"] > self.interval[1]

    @property
    def covered(self) -> bool:
        """Whether the interval of the error holds what was measured."""
        return not self.below and not self.above

    @property
    def met(self) -> bool | None:
        """Whether the target was met; None without one."""
        return None if self.target_m is None else self.measured["error"] <= self.target_m

    def row(self) -> tuple[Cell, ...]:
        """Return what the table says of it, in mm."""
        p, q = ({name: 1e3 * each for name, each in of.items()} for of in self._both)
        low, high = (1e3 * end for end in self.interval)
        outliers = (f"{100 * each['outliers']:.1f}" for each in self._both)
        return (
            self.scene,
            self.goal,
            self.choice,
            1e3 * self.capture_s,
            p["std"],
            p["bias"],
            f"{p['error']:.3g} ({low:.3g} to {high:.3g})",
            f"{q['std']:.3g}, {q['bias']:.3g}, {q['error']:.3g}",
            self.ratios["error"],
            ", ".join(outliers),
            {None: None, True: "yes", False: "no"}[self.met],
        )

    @property
    def _both(self) -> tuple[dict[str, float], dict[str, float]]:
        return self.predicted, self.measured


@dataclass(frozen=True)
class Refused:
    """A goal that is out of reach, and why."""

    scene: str
    goal: str
    why: str


def expectations(rows: list[PlanOutcome]) -> list[str]:
    """State in plain words what to expect of a plan: coverage, targets met, ratios."""
    targets = [row.met for row in rows if row.met is not None]
    above = [row for row in rows if row.above]
    below = [row for row in rows if row.below]
    inside = len(rows) - len(above) - len(below)
    biased = [row for row in rows if row.measured["bias"] > row.measured["std"] / 2]
    of_bias = f"bias, of the {len(biased)} where it is more than half of the noise"
    off = max(abs(row.device_s / row.capture_s - 1) for row in rows)
    return [
        f"- A target is reached by {sum(targets)} of {len(targets)} plans, "
        f"{sum(targets) / max(len(targets), 1):.0%} (bar: 80 %).",
        f"- The interval that a plan states, 90 %, holds the measured error of {inside} of "
        f"{len(rows)}, {inside / len(rows):.0%} (bar: 85 to 95 %). {len(above)} errors lie above "
        f"it{_of(above)}, {len(below)} below it{_of(below)}.",
        f"- {by_mark(rows)}",
        *(
            f"- {what}: measured / predicted least, 10 %, 50 %, 90 %, most: "
            + ", ".join(f"{np.quantile(ratios, q):.2f}" for q in (0, 0.1, 0.5, 0.9, 1))
            for what, ratios in (
                ("noise", [row.ratios["std"] for row in rows]),
                (of_bias, [row.ratios["bias"] for row in biased]),
                ("error", [row.ratios["error"] for row in rows]),
            )
            if ratios
        ),
        f"- times of the device differ from planned ones by at most {off:.2%}",
        f"- saturated pixels: at most {max(row.saturated for row in rows):.2%}",
    ]


def by_mark(rows: list[PlanOutcome]) -> str:
    """State how many intervals hold and targets are met, with a known bias and without."""
    words = []
    for known, name in ((True, "known"), (False, "unknown")):
        own = [row for row in rows if row.bias_known == known]
        held = sum(row.covered for row in own)
        targets = [row.met for row in own if row.met is not None]
        words.append(
            f"of {len(own)} plans whose bias is said to be {name} the intervals hold {held}, and "
            f"{sum(targets)} of {len(targets)} targets are met"
        )
    return ("; ".join(words) + ".").capitalize()


def _of(rows: list[PlanOutcome]) -> str:
    """Name the scenes of some plans."""
    names = sorted({row.scene for row in rows})
    return f" ({', '.join(names)})" if names else ""


def table(rows: list[PlanOutcome], refused: list[Refused]) -> Table:
    """Return all plans, and what was refused."""
    columns = heads(
        "scene | goal | recommended | ms:.0f | noise:.3g | bias:.3g | error (90 %) mm | "
        "measured noise, bias, error | ratio:.2f | outliers % | met"
    )
    said = [f"- refused: {each.scene}, {each.goal}: {each.why}" for each in refused]
    return Table("Do plans keep what they promise?", columns, [each.row() for each in rows], said)
