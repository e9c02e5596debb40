"""What the verb ``plan`` prints for people."""

import json
from collections.abc import Iterable, Mapping
from typing import Any, Final

from transientcam.cli.terminal import echo
from transientcam.text import figures

MOVING: Final = 0.02
"""Share of moving pixels from which on it is said."""
_COLUMNS: Final = ("time ms", "error mm", "interval", "p90 mm", "noise mm", "bias mm", "sequence")
_ITEMS: Final = ("light", "readout", "settling", "transport", "computing", "sum")


def print_plan(document: Mapping[str, Any], *, computing: bool) -> None:
    """Print a recommended sequence, what it gives, and its neighbours."""
    predicted = document["predicted"]
    error, std = predicted["range_error_m"], predicted["range_std_m"]
    echo(json.dumps(document["sequence"]))
    echo(f"estimator {document['estimator']}")
    time_ms, rate_hz = document["capture_s"] * 1e3, document["frame_rate_hz"]
    echo(f"captures in {time_ms:.1f} ms ({rate_hz:.1f} Hz back to back)")
    if computing:
        echo(
            f"reconstructs in {document['reconstruct_s'] * 1e3:.1f} ms, "
            f"{document['computing_share']:.1%} of the time"
        )
    echo(
        f"error {error['median'] * 1e3:.2f} mm in the median pixel ({_interval_mm(error)}), "
        f"{error['p90'] * 1e3:.2f} mm at 90 %: "
        f"noise {std['median'] * 1e3:.2f} mm, bias {_bias_mm(predicted)} mm"
    )
    if predicted["within"] is not None:
        _print_within(predicted["within"], document["region"])
    echo(document["summary"])
    _print_price(document["price"], document["computing_s"])
    echo(document["price_summary"])
    _print_scene(document["scene"])
    if predicted["beyond_scene"]:
        echo("at best: this resolves more of the scene than the capture it is predicted from")
    if predicted["separation_share"] is not None:
        echo(f"finds both returns in {predicted['separation_share']:.0%} of captures")
    if predicted["bound_width"] is not None:
        echo(f"bounds {figures(predicted['bound_width'], 3)} times the mean density apart")
    for name, what in (("half_time", "half the time"), ("twice_accuracy", "twice the accuracy")):
        _print_neighbour(what, document[name])


def print_front(document: Mapping[str, Any]) -> None:
    """Print the sequences that no other beats, by rising time, and a sentence about them."""
    rows = [_COLUMNS, *(_row(each) for each in document["front"])]
    widths = [max(len(row[k]) for row in rows) for k in range(len(_COLUMNS) - 1)]
    for *numbers, words in rows:
        cells = [cell.rjust(width) for cell, width in zip(numbers, widths, strict=True)]
        echo("  ".join([*cells, words]))
    echo(document["summary"])


def print_takes(predicted: Iterable[Mapping[str, Any]]) -> None:
    """Print what more takes give, where nothing else can be chosen."""
    for each in predicted:
        cost = f"{each['capture_s'] * 1e3:.1f} ms ({each['frame_rate_hz']:.1f} Hz)"
        echo(f"takes {each['takes']:>2}: {cost}, range to {each['range_std_m'] * 1e3:.2f} mm")


def _row(choice: Mapping[str, Any]) -> tuple[str, ...]:
    from transientcam_driver import Sequence
    from transientcam_server.planning import in_words

    predicted = choice["predicted"]
    error = predicted["range_error_m"]
    return (
        figures(choice["capture_s"] * 1e3, 4),
        figures(error["median"] * 1e3, 3),
        _interval_mm(error, 3),
        figures(error["p90"] * 1e3, 3),
        figures(predicted["range_std_m"]["median"] * 1e3, 3),
        _bias_mm(predicted, 3),
        in_words(Sequence.from_document(choice["sequence"]), choice["estimator"]),
    )


def _print_within(within: Mapping[str, Any], region: object) -> None:
    where = "the lit pixels" if region is None else "the region's lit pixels"
    target_m = within["target_m"]
    met = "" if target_m is None else f"; {within['target_share']:.0%} within {target_m * 1e3:g} mm"
    echo(
        f"a capture has {within['share']:.0%} of {where} within {within['error_m'] * 1e3:.2f} mm "
        f"({_interval_mm(within)}){met}"
    )


def _print_price(price: Mapping[str, Any], computing_s: Mapping[str, float | None]) -> None:
    """Print what a capture takes, item by item, and what else it costs."""
    times_s = [price[f"{name}_s"] for name in _ITEMS]
    cells = ["?" if each is None else f"{each * 1e3:.1f}" for each in times_s]
    if None in times_s:
        cells[-1] = f">={cells[-1]}"
    widths = [max(map(len, pair)) for pair in zip(_ITEMS, cells, strict=True)]
    for row in (_ITEMS, cells):
        padded = (cell.rjust(width) for cell, width in zip(row, widths, strict=True))
        echo("  ".join((*padded, "ms" if row is cells else "")).rstrip())
    known = [f"{name} {each * 1e3:.1f} ms" for name, each in computing_s.items() if each]
    if known:
        echo(f"computing by estimator: {', '.join(known)}")
    megabytes = price["data_bytes"] / 1e6
    echo(f"{megabytes:.2f} MB a capture; the light is on for {price['light_share']:.0%} of it")


def _interval_mm(figure: Mapping[str, Any], digits: int | None = None) -> str:
    low, high = (None if at is None else _mm(at, digits) for at in (figure["low"], figure["high"]))
    return f"at least {low}" if high is None else f"{low} to {high}"


def _bias_mm(predicted: Mapping[str, Any], digits: int | None = None) -> str:
    """Return a bias in mm; with a question mark where the look does not tell it."""
    return _mm(predicted["range_bias_m"], digits) + "?" * (not predicted["bias_known"])


def _mm(length_m: float, digits: int | None) -> str:
    return f"{length_m * 1e3:.2f}" if digits is None else figures(length_m * 1e3, digits)


def _print_scene(scene: Mapping[str, Any]) -> None:
    echo(
        f"seen: {scene['lit_share']:.0%} of the pixels lit, at {scene['range_m']:.2f} m; "
        f"{figures(scene['ambient_dn_per_s'], 3)} DN/s of ambient light"
    )
    if scene["moving_share"] > MOVING:
        echo(
            f"{scene['moving_share']:.0%} of them move: planned for the others, with what that adds"
        )
    if not scene["ambiguity_checked"]:
        echo("whether ranges are short by a period was not checked")


def _print_neighbour(what: str, other: Mapping[str, Any] | None) -> None:
    if other is None:
        echo(f"{what}: no sequence does")
        return
    factor, slower = other["error_factor"], figures(other["time_factor"], 2)
    errors = "" if factor is None else f"{figures(factor, 2)} x the error, "
    echo(
        f"{what}: {errors}{slower} x the time, estimator {other['estimator']}: "
        f"{json.dumps(other['sequence'])}"
    )
