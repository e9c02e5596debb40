"""One plan, or what takes give, held against captures: the rows of the page of plans."""

import math
from dataclasses import dataclass

import numpy as np

from benchmarks.common.tables import Cell, Table, heads

REGRET = 1.3


@dataclass(frozen=True)
class Outcome:
    """A plan, and the share of its captures' pixels within the target; lengths in m."""

    device: str
    scene: str
    target_m: float
    plan: str
    plan_s: float = math.nan
    predicted_m: tuple[float, float, float] = (math.nan, math.nan, math.nan)
    """What 90 % of the ranges are within, and the ends of its interval."""
    measured_m: float = math.nan
    share: float = math.nan
    bias_known: bool = True
    quickest_s: float = math.inf
    """Of the grid that reaches the target."""
    refused: bool = False
    """Whether it is said to be out of reach; else a plan without a time is left undecided."""

    @property
    def met(self) -> bool:
        """Whether as many pixels as asked for are within the target."""
        return self.share >= SHARE

    @property
    def held(self) -> bool:
        """Whether the interval has what was measured."""
        return self.predicted_m[1] <= self.measured_m <= self.predicted_m[2]

    @property
    def regret(self) -> float:
        """Time over that of the quickest that is known to reach the target."""
        return self.plan_s / min(self.plan_s, self.quickest_s)

    def row(self) -> tuple[Cell, ...]:
        """Return what the table says of it."""
        expected, low, high = (1e3 * each for each in self.predicted_m)
        upper = f"to {high:.3g}" if math.isfinite(high) else "or more"
        grid_ms = 1e3 * self.quickest_s if math.isfinite(self.quickest_s) else None
        begin = self.device, self.scene, f"{1e3 * self.target_m:g} mm", self.plan
        if math.isnan(self.plan_s):
            return *begin, None, "-", None, None, "-", grid_ms
        said = f"{expected:.3g} ({low:.3g} {upper})"
        met = "yes" if self.met else "no"
        return *begin, 1e3 * self.plan_s, said, 1e3 * self.measured_m, self.share, met, grid_ms


SHARE = 0.9


def tables_of(found: list[Outcome]) -> tuple[Table, Table]:
    """Return what each device's plans come to, and all plans."""
    short = Table(
        "Do plans keep what they promise?",
        heads(
            "camera | targets met | intervals that hold | known bias: width | refused in error | "
            "left undecided | within 1.3 of the quickest"
        ),
    )
    for device in dict.fromkeys(each.device for each in found):
        own = [each for each in found if each.device == device]
        made = [each for each in own if not math.isnan(each.plan_s)]
        known = [each.predicted_m[2] / each.predicted_m[1] for each in made if each.bias_known]
        refused = [each for each in own if each.refused]
        wrong = sum(math.isfinite(each.quickest_s) for each in refused)
        compared = [each for each in made if each.met and math.isfinite(each.quickest_s)]
        quick = sum(each.regret <= REGRET for each in compared)
        short.rows.append(
            (
                device,
                f"{sum(each.met for each in made)} of {len(made)}",
                f"{sum(each.held for each in made)} of {len(made)}",
                f"{np.median(known):.2f} ({len(known)})" if known else "-",
                f"{wrong} of {len(own)}",
                f"{len(own) - len(made) - len(refused)}",
                f"{quick} of {len(compared)}" if compared else "-",
            )
        )
    columns = heads(
        "camera | scene | target | plan | ms:.0f | 90 % within, mm | captured:.3g | "
        "within the target:.0% | met | grid, ms:.0f"
    )
    return short, Table("", columns, [each.row() for each in found])
