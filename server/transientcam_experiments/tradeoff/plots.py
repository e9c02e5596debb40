"""Pareto plots of what was measured; needs the extra ``plot``."""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, Final

from transientcam_experiments.tradeoff.records import Record
from transientcam_server.planning import front


@dataclass(frozen=True, slots=True)
class Axes:
    """What a plot shows: ``error`` against ``cost``, one colour for each value of ``colour``."""

    kind: str
    title: str
    cost: str
    cost_label: str
    error: str
    error_label: str
    colour: str
    only: Mapping[str, Any] = field(default_factory=dict)

    def shows(self, record: Record) -> bool:
        """Whether a result belongs to this plot and has both of its quantities."""
        values = record.values
        positive = all((values.get(each) or 0) > 0 for each in (self.cost, self.error))
        mine = all(record.point.get(name) == value for name, value in self.only.items())
        return record.kind == self.kind and positive and mine


_TIME: Final = ("seconds", "computing time of a frame / s")
_COSTS: Final = {
    "capture": ("capture_s", "capture time / s", "harmonics"),
    "computing": (*_TIME, "method"),
    "estimating": (*_TIME, "estimator"),
    "transport": ("bytes", "bytes of a frame", "coding"),
}


def _axes(kind: str, **stated: Any) -> Axes:
    cost, cost_label, colour = _COSTS[kind]
    return Axes(kind=kind, cost=cost, cost_label=cost_label, colour=colour, **stated)


PLOTS: Final = {
    name: _axes(**each)
    for name, each in tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8")).items()
}
"""Every plot by the name of its file."""


def draw(axes: Axes, scene: str, records: Iterable[Record]) -> dict[str, bytes] | None:
    """Return a plot as "png" and "svg", or None where there is nothing on it.

    In the SVG each point is a group whose id is the point's key.
    """
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    shown = [record for record in records if record.scene == scene and axes.shows(record)]
    if not shown:
        return None
    # the same results give the same bytes
    with rc_context({"svg.hashsalt": "transientcam", "svg.fonttype": "none"}):
        figure = Figure(figsize=(7.0, 4.6), layout="constrained")
        FigureCanvasAgg(figure)
        _fill(figure.subplots(), axes, scene, shown)
        images = {}
        for suffix in ("png", "svg"):
            file = BytesIO()
            metadata: dict[str, str | None] = {"Date": None} if suffix == "svg" else {}
            figure.savefig(file, format=suffix, dpi=120, metadata=metadata)
            images[suffix] = file.getvalue()
    return images


def _fill(panel: Any, axes: Axes, scene: str, shown: list[Record]) -> None:
    groups = sorted({str(record.point[axes.colour]) for record in shown}, key=_natural)
    for number, group in enumerate(groups):
        mine = [record for record in shown if str(record.point[axes.colour]) == group]
        for index, record in enumerate(mine):
            drawn = panel.errorbar(
                record.values[axes.cost],
                record.values[axes.error],
                yerr=_bar(record, axes),
                fmt="o",
                color=f"C{number % 10}",
                markersize=5,
                elinewidth=0.8,
                label=None if index else _name(axes.colour, group),
            )
            drawn.lines[0].set_gid(point_id(record))
    best = front(
        shown,
        cost=lambda record: float(record.values[axes.cost] or 0),
        error=lambda record: float(record.values[axes.error] or 0),
    )
    panel.plot(
        [record.values[axes.cost] for record in best],
        [record.values[axes.error] for record in best],
        color="0.5",
        linewidth=1.0,
        zorder=0,
    )
    panel.set(
        xscale="log",
        yscale="log",
        xlabel=axes.cost_label,
        ylabel=axes.error_label,
        title=f"{scene}: {axes.title}",
    )
    panel.grid(which="both", alpha=0.25)
    panel.legend(fontsize="small", framealpha=0.7)


def point_id(record: Record) -> str:
    """Return an id that is fit for HTML and the same for the same point."""
    from hashlib import blake2b

    return "p" + blake2b(record.key.encode(), digest_size=8).hexdigest()


def _bar(record: Record, axes: Axes) -> list[list[float]] | None:
    """Spread over the repetitions; below, no further than a log axis can show."""
    spread, value = record.spread.get(axes.error), record.values[axes.error]
    if not spread or not value:
        return None
    return [[min(spread, 0.9 * value)], [spread]]


def _name(colour: str, group: str) -> str:
    return f"m = {group}" if colour == "harmonics" else group


def _natural(text: str) -> tuple[int, str]:
    return (int(text) if text.isdigit() else 0, text)
