"""What accuracy costs in time, in one picture: noise falls with time onto the bias that stays."""

import io
from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from transientcam_server.planning import flat_from


def error_picture(
    tradeoff: Mapping[str, Any], title: str, present: tuple[float, float] | None = None
) -> Figure:
    """Draw time across and range error up, both logarithmic.

    ``tradeoff``: the answer of `GET /api/v1/tradeoff`, or `Planner.tradeoff_document`: its
    ``lines``, ``front`` and ``summary``.
    ``title``: of the scene.
    ``present``: time of one capture in s and error in m of the present setting.
    """
    figure = blank(7.2, 5.0)
    panel: Axes = figure.subplots()
    for number, line in enumerate(tradeoff["lines"]):
        colour = f"C{number}"
        time_s = [point["capture_s"] for point in line["points"]]
        for name, style in (("range_std_m", "--"), ("range_bias_m", ":"), ("range_error_m", "-")):
            panel.plot(
                time_s,
                [point[name] for point in line["points"]],
                style,
                color=colour,
                linewidth=1,
                label=_label(line) if name == "range_error_m" else None,
            )
    front = tradeoff["front"]
    time_s = [choice["capture_s"] for choice in front]
    error_m = [choice["predicted"]["range_error_m"]["median"] for choice in front]
    panel.plot(time_s, error_m, "o-", color="black", linewidth=3, label="best for the time")
    error_for_time(panel, f"{title}: noise (dashed), bias (dotted), both together")
    _shade(panel, front)
    if present is not None:
        panel.plot(*present, "*", color="red", markersize=14, label="present setting")
    panel.legend(fontsize="small")
    panel.grid(alpha=0.25)
    figure.supxlabel(tradeoff["summary"], fontsize="small", wrap=True)
    return figure


def error_for_time(panel: Axes, title: str) -> None:
    """Give a panel the axes of error over time."""
    names = "time of one capture / s", "range error of the median pixel / m"
    panel.set(xscale="log", yscale="log", xlabel=names[0], ylabel=names[1], title=title)


def blank(width_in: float, height_in: float) -> Figure:
    """Return an empty picture that needs no display."""
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def saved(figure: Figure, suffix: str) -> bytes:
    """Return a figure as ``png`` or ``svg``, the same for the same figure."""
    stream = io.BytesIO()
    metadata = {"Software": None} if suffix == "png" else {"Date": None}
    figure.savefig(stream, format=suffix, dpi=110, metadata=metadata)
    return stream.getvalue()


def errors_m(choice: Mapping[str, Any]) -> tuple[float, float, float]:
    """Return noise, bias, and both together, that are predicted of a choice."""
    predicted = choice["predicted"]
    std_m, error_m = (predicted[name]["median"] for name in ("range_std_m", "range_error_m"))
    return std_m, predicted["range_bias_m"], error_m


def _label(line: Mapping[str, Any]) -> str:
    return (
        f"m = {line['harmonics']} at {line['base_frequency_hz'] / 1e6:g} MHz, {line['estimator']}"
    )


def _shade(panel: Axes, front: list[Mapping[str, Any]]) -> None:
    """Shade the times from which on bias rules and more time buys little."""
    flat = flat_from([errors_m(choice) for choice in front])
    if flat is None:
        return
    ruled_s = front[flat]["capture_s"]
    left, right = panel.get_xlim()
    panel.axvspan(ruled_s, right, color="0.85", zorder=0)
    panel.set_xlim(left, right)
    panel.text(
        ruled_s,
        0.98,
        " bias rules: more time\n buys little",
        transform=panel.get_xaxis_transform(),
        fontsize="small",
        va="top",
        bbox={"facecolor": "0.85", "edgecolor": "none", "pad": 1},
    )
