"""How docs/accuracy.md opens: what 5 mm cost on each scene, in one picture and a sentence each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from transientcam_experiments.tradeoff.picture import errors_m, saved
from transientcam_server.planning import flat_from

TARGET_M: Final = 5e-3
PICTURE: Final = "accuracy-price.png"
BEGIN: Final = "<!-- opening: python -m benchmarks.accuracy.pictures --write -->"
END: Final = "<!-- end of the opening -->"
Front = Sequence[Mapping[str, Any]]
"""That of the answer of `GET /api/v1/tradeoff`."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """What is predicted of a scene, and the measured error of the choice that is stated.

    ``summary`` says from where on more time buys little.
    """

    front: Front
    summary: str
    measured_m: float


Documents = Mapping[str, Drawn]
"""By the name of the scene."""


def opening(documents: Documents, machine: str) -> str:
    """Return the opening, between its marks."""
    lines = [
        BEGIN,
        "## What do I pay for 5 mm?",
        "",
        f"![Range error against the time of a capture, by scene](figures/{PICTURE})",
        "",
        *[
            f"- **{name}**: {price(each.front, each.measured_m)}"
            for name, each in documents.items()
        ],
        "",
        "Each line is the best that `transientcam plan` predicts for the time, noise and bias "
        "together, of the median lit pixel; measured is what captures with another specimen of "
        "noise err by. Planned with margin, by which four of five plans are to reach their target "
        "([plans](plans.md)), a plan takes longer. Light that none of the frequencies of the look "
        "resolves moves a range without any sign of it: neither the error nor `outlier_share` has "
        "that.",
        "",
        *[
            f"![Range error against capture time on {name}](figures/accuracy-{name}-error.png)\n"
            for name in documents
        ],
        "Thin lines are sets of frequencies: noise (dashed) falls with time, bias (dotted) stays. "
        "The star is the default sequence with the default estimator, as captured.",
        "",
        f"Measured by `python -m benchmarks.accuracy.pictures --write` on {machine}.",
        "",
        END,
    ]
    return "\n".join(lines)


def priced(front: Front) -> int:
    """Return the first place of a front with an error below `TARGET_M`, or else the last."""
    reached = (place for place, each in enumerate(front) if _error_m(each) <= TARGET_M)
    return next(reached, len(front) - 1)


def price(front: Front, measured_m: float) -> str:
    """State the time from which on the error is below `TARGET_M`, and what rules there.

    Parameters
    ----------
    measured_m
        Error of captures with the choice at `priced`.
    """
    place = priced(front)
    first = front[place]
    sequence = first["sequence"]
    reached = _error_m(first) <= TARGET_M
    cost = "at most" if reached else "5 mm are out of reach; the best takes"
    return (
        f"{cost} {first['capture_s'] * 1e3:.3g} ms, for {_error_m(first) * 1e3:.3g} mm "
        f"(measured {measured_m * 1e3:.3g} mm), {_ruled_by(front, place)} "
        f"(m = {sequence['harmonics']} at {sequence['base_frequency_hz'] / 1e6:g} MHz, "
        f"{first['estimator']})."
    )


def draw_prices(documents: Documents, folder: Path) -> None:
    """Draw the best error for the time of all scenes into one picture."""
    figure = Figure(figsize=(7.2, 4.6), layout="constrained")
    FigureCanvasAgg(figure)
    panel = figure.subplots()
    for name, drawn in documents.items():
        front = drawn.front
        time_s = [each["capture_s"] for each in front]
        panel.plot(time_s, [_error_m(each) for each in front], "o-", label=name)
    panel.axhline(TARGET_M, color="black", linestyle="--", linewidth=1)
    panel.set(
        xscale="log",
        yscale="log",
        xlabel="time of one capture / s",
        ylabel="range error of the median pixel / m",
        title="What does 5 mm (dashed) cost? Noise and bias together",
    )
    panel.grid(alpha=0.25, which="both")
    panel.legend()
    (folder / PICTURE).write_bytes(saved(figure, "png"))


def replaced(page: str, text: str) -> str:
    """Return a page with another opening: in place of the last, else below its first heading."""
    if BEGIN in page:
        before, _, rest = page.partition(BEGIN)
        return before + text + rest.partition(END)[2]
    heading, _, rest = page.partition("\n\n")
    return f"{heading}\n\n{text}\n\n{rest}"


def _error_m(choice: Mapping[str, Any]) -> float:
    return errors_m(choice)[2]


def _ruled_by(front: Front, place: int) -> str:
    noise_m, bias_m, _ = errors_m(front[place])
    if bias_m <= noise_m:
        return "noise rules: more time buys accuracy"
    flat = flat_from([errors_m(each) for each in front])
    if flat is not None and place >= flat:
        return "bias rules: more time buys little"
    return "bias rules these frequencies: others take longer, and err less"
