"""Estimators held against each other on scenes whose truth is known."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import transientcam_moments as tm
from transientcam_experiments.tradeoff import estimating
from transientcam_experiments.tradeoff.measuring import Bench
from transientcam_moments.comparisons import TECHNIQUES, technique_of

SCENES: Final = ("wall", "corner", "mirrors", "translucent", "cornell")
"""Scenes that come with the driver and stand still, the simplest first."""
_SLOW: Final = "sra-table"
"""Its table takes a minute to build."""


@dataclass(frozen=True, slots=True)
class Compared:
    """One estimator before one scene."""

    scene: str
    estimator: str
    values: dict[str, float | None]
    """`estimating.QUANTITIES`; none where it could not be measured."""
    failed: str | None
    """Why."""


def rivals(harmonics: int) -> tuple[str, ...]:
    """Return what an estimator is held against, where its user does not say."""
    return tuple(
        technique.name
        for technique, point in estimating.points(harmonics)
        if point["planar"] and technique.name in TECHNIQUES and technique.name != _SLOW
    )


def compare(
    names: Iterable[str], scenes: Iterable[str], *, harmonics: int, seed: int
) -> Iterator[Compared]:
    """Yield what each estimator errs by on each scene, all on the same noisy moments.

    One that fails, or needs more harmonics, is yielded with the reason.
    Raises KeyError where there is no estimator of a name, SceneError where a scene can't be opened.
    """
    wanted = list(names)
    for scene in scenes:
        seen = Bench(scene, seed=seed).scene(harmonics)
        for name in wanted:
            values: dict[str, float | None] = {}
            failed = None
            try:
                technique = technique_of(name)
                values = estimating.measure(technique, seen, repetitions=1, seed=seed)[0]
            except tm.MomentsError as error:
                failed = str(error)
            yield Compared(scene, name, values, failed)


def draw(path: Path, found: Iterable[Compared]) -> None:
    """Draw the median error and that of nine of ten pixels by scene; needs the extra ``plot``."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    errors: dict[str, list[tuple[str, float, float]]] = {}
    for each in found:
        middle, most = (each.values.get(f"range_{name}_m") for name in ("median", "p90"))
        if middle is not None and most is not None:
            errors.setdefault(each.scene, []).append((each.estimator, middle * 1e3, most * 1e3))
    figure = Figure(figsize=(3.2 * max(len(errors), 1), 4.5), layout="constrained")
    FigureCanvasAgg(figure)  # draws without a display
    panels = figure.subplots(1, max(len(errors), 1), sharey=True, squeeze=False)[0]
    for panel, (scene, rows) in zip(panels, errors.items(), strict=False):
        labels, middle_mm, most_mm = zip(*rows, strict=True)
        panel.plot(middle_mm, labels, "o", label="median")
        panel.plot(most_mm, labels, "|", label="nine of ten pixels below")
        panel.set(xscale="log", title=scene, xlabel="error of the range / mm")
        panel.grid(alpha=0.3)
    panels[0].legend(fontsize="small", loc="lower right")
    figure.savefig(path, dpi=120, format="png")
