"""What 5 mm cost on each scene, in one picture and a sentence each."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from benchmarks.accuracy.capturing import dimmest_dn_per_s, looked, measured
from benchmarks.common.picture import blank, error_for_time, error_picture, errors_m, saved
from benchmarks.common.tables import Table
from transientcam_driver import Sequence as Capture
from transientcam_server.planning import Goal, flat_from

SCENES: Final = ("wall", "corner", "corner-left", "mirrors", "translucent")
PRESENT: Final = Capture(harmonics=4, zeroth="estimated")
"""The default sequence of the daemon."""
CAPTURES: Final = 10
TARGET_M: Final = 5e-3
PICTURE: Final = "accuracy-price.png"
Front = Sequence[Mapping[str, Any]]
"""That of the answer of `GET /api/v1/tradeoff`."""


def tables(figures: Path, *, scenes: tuple[str, ...] = SCENES) -> Iterator[Table]:
    """Plan and capture, draw time and error of each scene, by name or .toml, and all together."""
    fronts, said, pictures = {}, [], []
    for scene in scenes:
        name = Path(scene).stem
        fronts[name], error_m = _drawn(scene, figures)
        said.append(f"- **{name}**: {price(fronts[name], error_m)}")
        title = f"Range error against capture time on {name}"
        pictures.append(f"![{title}](../figures/accuracy-{name}-error.png)")
    draw_prices(fronts, figures / PICTURE)
    together = "Range error against the time of a capture, by scene"
    picture = f"![{together}](../figures/{PICTURE})"
    yield Table("What do I pay for 5 mm?", text=[picture, *said], notes=pictures)


def _drawn(scene: str, folder: Path) -> tuple[Front, float]:
    """Draw a scene's picture; return the front, and the error of captures where it is priced."""
    name = Path(scene).stem
    planner, statistics = looked(scene)
    document = planner.tradeoff_document(Goal(share=None), statistics)
    values, device_s, _ = measured(scene, PRESENT, "likelihood", CAPTURES)
    figure = error_picture(document, name, (device_s, values["error"]))
    (folder / f"accuracy-{name}-error.png").write_bytes(saved(figure, "png"))
    front: Front = document["front"]
    first = front[priced(front)]
    sequence, dimmest = Capture.from_document(first["sequence"]), dimmest_dn_per_s(statistics)
    captured, _, _ = measured(scene, sequence, first["estimator"], CAPTURES, dimmest)
    return front, captured["error"]


def priced(front: Front) -> int:
    """Return the first place of a front with an error below `TARGET_M`, or else the last."""
    reached = (place for place, each in enumerate(front) if errors_m(each)[2] <= TARGET_M)
    return next(reached, len(front) - 1)


def price(front: Front, measured_m: float) -> str:
    """State the time from which on the error is below `TARGET_M`, and what rules there.

    ``measured_m``: error of captures with the choice at `priced`.
    """
    place = priced(front)
    first = front[place]
    sequence, error_m = first["sequence"], errors_m(first)[2]
    cost = "at most" if error_m <= TARGET_M else "5 mm are out of reach; the best takes"
    return (
        f"{cost} {first['capture_s'] * 1e3:.3g} ms, for {error_m * 1e3:.3g} mm "
        f"(measured {measured_m * 1e3:.3g} mm), {_ruled_by(front, place)} "
        f"(m = {sequence['harmonics']} at {sequence['base_frequency_hz'] / 1e6:g} MHz, "
        f"{first['estimator']})."
    )


def draw_prices(fronts: Mapping[str, Front], path: Path) -> None:
    """Draw the best error for the time of all scenes, by name, into one picture."""
    figure = blank(7.2, 4.6)
    panel = figure.subplots()
    for name, front in fronts.items():
        time_s = [each["capture_s"] for each in front]
        panel.plot(time_s, [errors_m(each)[2] for each in front], "o-", label=name)
    panel.axhline(TARGET_M, color="black", linestyle="--", linewidth=1)
    error_for_time(panel, "What does 5 mm (dashed) cost? Noise and bias together")
    panel.grid(alpha=0.25, which="both")
    panel.legend()
    path.write_bytes(saved(figure, "png"))


def _ruled_by(front: Front, place: int) -> str:
    noise_m, bias_m, _ = errors_m(front[place])
    if bias_m <= noise_m:
        return "noise rules: more time buys accuracy"
    flat = flat_from([errors_m(each) for each in front])
    if flat is not None and place >= flat:
        return "bias rules: more time buys little"
    return "bias rules these frequencies: others take longer, and err less"
