"""What was measured of plans, and how docs/plans.md states it."""

from dataclasses import dataclass

import numpy as np

WRONG = """\
- The bias is predicted too small where light comes back late and no frequency of the look shows it:
  where it enters the material, as in wax and soap, or where a part of the scene is lit by other
  walls alone. A longer capture does not help there. The upper end of an interval is made for such
  scenes, and plans for them are marked: `bias_known` is false, and the summary says why."""


@dataclass(frozen=True)
class Kept:
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


@dataclass(frozen=True)
class Refused:
    """A goal that is out of reach, and why."""

    scene: str
    goal: str
    why: str


def expectations(rows: list[Kept]) -> str:
    """State in plain words what to expect of a plan."""
    targets = [row.met for row in rows if row.met is not None]
    above = [row for row in rows if row.above]
    below = [row for row in rows if row.below]
    inside = len(rows) - len(above) - len(below)
    noise = np.array([row.ratios["std"] for row in rows])
    low, high = np.quantile(noise, [0.1, 0.9])
    lines = [
        f"- A target is reached by {sum(targets)} of {len(targets)} plans, "
        f"{sum(targets) / max(len(targets), 1):.0%} (bar: 80 %).",
        f"- The interval that a plan states, 90 %, holds the measured error of {inside} of "
        f"{len(rows)}, {inside / len(rows):.0%} (bar: 85 to 95 %). {len(above)} errors lie above "
        f"it{_of(above)}, {len(below)} below it{_of(below)}.",
        f"- {by_mark(rows)}",
        f"- Noise: 80 % of the measured deviations are {low:.2f} to {high:.2f} of the predicted.",
        WRONG,
    ]
    return "\n".join(lines)


def by_mark(rows: list[Kept]) -> str:
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


def _of(rows: list[Kept]) -> str:
    """Name the scenes of some plans."""
    names = sorted({row.scene for row in rows})
    return f" ({', '.join(names)})" if names else ""


def summary(rows: list[Kept]) -> str:
    """State ratios, coverage and targets met."""
    lines = []
    biased = [row for row in rows if row.measured["bias"] > row.measured["std"] / 2]
    of_bias = f"bias, of the {len(biased)} where it is more than half of the noise"
    for name, which in (("std", rows), ("bias", biased), ("error", rows)):
        if which:
            ratios = [row.ratios[name] for row in which]
            quantiles = ", ".join(f"{np.quantile(ratios, q):.2f}" for q in (0, 0.1, 0.5, 0.9, 1))
            what = of_bias if name == "bias" else name
            lines.append(f"{what}: measured / predicted least, 10 %, 50 %, 90 %, most: {quantiles}")
    covered = np.mean([row.covered for row in rows])
    lines.append(
        f"90 % intervals hold the measured error in {covered:.0%} of {len(rows)} (bar: 85 to 95 %)"
    )
    targets = [row.met for row in rows if row.met is not None]
    if targets:
        share = np.mean(targets)
        lines.append(f"targets met: {sum(targets)} of {len(targets)}, {share:.0%} (bar: 80 %)")
    off = max(abs(row.device_s / row.capture_s - 1) for row in rows)
    lines.append(f"times of the device differ from planned ones by at most {off:.2%}")
    lines.append(f"saturated pixels: at most {max(row.saturated for row in rows):.2%}")
    return "\n".join(lines)


def table(rows: list[Kept]) -> str:
    """Return all plans as a table."""
    head = (
        "| scene | goal | recommended | ms | noise | bias | error (90 %) mm | "
        "measured noise, bias, error | ratio | outliers % | met |\n" + "|---" * 11 + "|"
    )
    lines = [head]
    for row in rows:
        p, q = row.predicted, row.measured
        low, high = row.interval
        met = {None: "–", True: "yes", False: "no"}[row.met]
        lines.append(
            f"| {row.scene} | {row.goal} | {row.choice} | {row.capture_s * 1e3:.0f} "
            f"| {p['std'] * 1e3:.3g} | {p['bias'] * 1e3:.3g} "
            f"| {p['error'] * 1e3:.3g} ({low * 1e3:.3g} to {high * 1e3:.3g}) "
            f"| {q['std'] * 1e3:.3g}, {q['bias'] * 1e3:.3g}, {q['error'] * 1e3:.3g} "
            f"| {row.ratios['error']:.2f} | {p['outliers'] * 100:.1f}, {q['outliers'] * 100:.1f} "
            f"| {met} |"
        )
    return "\n".join(lines)


def page(rows: list[Kept], refused: list[Refused]) -> str:
    """Return summary, table and refusals."""
    lines = [f"- {line}" for line in summary(rows).splitlines()]
    lines += [f"- refused: {each.scene}, {each.goal}: {each.why}" for each in refused]
    return "\n".join([*lines, "", table(rows)])
