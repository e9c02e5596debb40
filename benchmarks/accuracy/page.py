"""The page docs/accuracy.md: tables of what was measured, and advice drawn from them."""

import numpy as np

from benchmarks.accuracy.capturing import short
from benchmarks.accuracy.noise import FRAMES, Compared
from benchmarks.accuracy.opening import Documents, opening
from benchmarks.accuracy.stated import FRAMES as OF_FRAMES
from benchmarks.accuracy.stated import Stated
from benchmarks.common.machine import machine
from transientcam_driver import Sequence
from transientcam_experiments import tradeoff
from transientcam_experiments.tradeoff.report import file_name


def report(
    scenes: dict[str, str],
    records: tradeoff.Records,
    noise: list[Compared],
    stated: list[Stated],
    prices: Documents,
) -> str:
    """Return the page."""
    lines = [
        "# What accuracy costs in time",
        "",
        opening(prices, machine()),
        "",
        "## All that was measured",
        "",
        "Written by `python -m benchmarks.accuracy --write` on",
        f"{machine()}.",
        "",
        "All scenes are simulated, so that the truth is known; images come over the emulated USB "
        "and go through what the daemon computes. `transientcam tradeoff --scene NAME -o FOLDER` "
        "measures the same on any scene and makes a page on which every point can be copied as a "
        "sequence. `transientcam plan` and `POST /api/v1/plan` turn a target or a budget into one; "
        "[docs/plans.md](plans.md) holds plans to what they promise.",
        "",
        *_glossary(),
        "",
    ]
    for name, spec in scenes.items():
        lines += _scene(name, spec, records)
    lines += [*_computing(records), *_noise(noise), *_stated(stated), *_time(scenes, records)]
    return "\n".join(lines) + "\n"


def _glossary() -> list[str]:
    return [
        "- **deviation**: standard deviation of the range of a typical pixel between captures,",
        "- **median error, RMSE**: of the range against the truth, by the first return "
        "(Pisarenko),",
        "- **peak RMSE**: by the first peak of the maximum entropy density; **m = 1 RMSE**: by the "
        "phase of the first frequency alone, as usual cameras do,",
        "- **returns**: share of pixels with as many returns as there are,",
        "- **light**: mean error of the light until any time of flight, as a share of all light,",
        "- **bounds**: distance of the sharp bounds on the density, over the mean density.",
    ]


def _captures(spec: str, records: tradeoff.Records) -> list[tradeoff.Record]:
    mine = [record for record in records if record.kind == "capture" and record.scene == spec]
    return sorted(mine, key=lambda record: record.values["capture_s"] or 0.0)


def _scene(name: str, spec: str, records: tradeoff.Records) -> list[str]:
    captures = _captures(spec, records)
    plain = [
        record
        for record in captures
        if record.point["sub_phases"] == {"scheme": "arccos", "n": 8}
        and record.point["takes"] in (1, 4, 20)
        and (
            record.point["exposure_s"] == 0.00192
            or (record.point["zeroth"], record.point["exposure_s"]) == ("estimated", 0.0005)
        )
    ]
    rows = [
        f"| {short(Sequence.from_document(record.point))} "
        f"| {_number(record, 'capture_s', 1e3, '{:.0f}')} "
        f"| {_number(record, 'range_std_m', 1e3)} | {_number(record, 'range_median_m', 1e3)} "
        f"| {_number(record, 'range_rmse_m', 1e3)} "
        f"| {_number(record, 'maximum_entropy_rmse_m', 1e3)} "
        f"| {_number(record, 'single_frequency_rmse_m', 1e3)} "
        f"| {_number(record, 'returns_right', 100, '{:.0f}')} "
        f"| {_number(record, 'cumulative_mean', 100, '{:.1f}')} "
        f"| {_number(record, 'bound_width', 1)} |"
        for record in plain
    ]
    return [
        f"## {name}",
        "",
        *advice(name, captures),
        "",
        "| sequence | capture ms | deviation mm | median error mm | RMSE mm | peak RMSE mm "
        "| m = 1 RMSE mm | returns % | light % | bounds |",
        "|---|---|---|---|---|---|---|---|---|---|",
        *rows,
        "",
        f"![Deviation of the range against capture time](figures/accuracy-{file_name(spec)}"
        f"-repeatability.png) ![Error of the light against capture time](figures/accuracy-"
        f"{file_name(spec)}-cumulative.png)",
        "",
    ]


def _number(record: tradeoff.Record, name: str, factor: float, form: str = "{:.3g}") -> str:
    value = record.values.get(name)
    return "–" if value is None else form.format(value * factor)


_KIND = {
    "wall": "One return a pixel.",
    "corner": "Diffuse light comes back close behind the direct return.",
    "mirrors": "Three sharp returns in most pixels.",
    "visitor": "A person moves before a bright wall while the images are taken.",
    "composite": "Three returns of different sharpness, measured with single photons.",
}


def advice(name: str, captures: list[tradeoff.Record]) -> list[str]:
    """Say plainly what the figures of a scene mean, from the figures."""
    by = {_key(record): record for record in captures}
    video, still = by.get((3, "estimated", 0.0005, 1)), by.get((3, "low-frequency", 0.00192, 1))
    four, eight = by.get((4, "low-frequency", 0.00192, 1)), by.get((8, "low-frequency", 0.00192, 1))
    sentences = [_KIND[name]] if name in _KIND else []
    sentences += _quickest(captures)
    if video is not None:
        sentences.append(
            "m = 3 without a zeroth moment at 0.5 ms runs at "
            f"{video.values['frame_rate_hz']:.1f} Hz with a deviation of "
            f"{_number(video, 'range_std_m', 1e3)} mm" + _returns_clause(video) + "."
        )
    if still is not None and four is not None and video is not None:
        sentences.append(
            f"A longer exposure and a zeroth moment (1.92 ms) take "
            f"{_times(still, video, 'capture_s')} the time for "
            f"{_times(still, video, 'range_std_m')} the deviation; m = 4 takes "
            f"{_times(four, video, 'capture_s')} the time for "
            f"{_times(four, video, 'range_std_m')} the deviation and "
            f"{_times(four, video, 'cumulative_mean')} the error of the light."
        )
    if eight is not None and four is not None:
        sentences.append(
            f"m = 8 at 11.5 MHz takes {_times(eight, four, 'capture_s')} the time of m = 4: "
            f"{_times(eight, four, 'range_std_m')} its deviation, "
            f"{_times(eight, four, 'cumulative_mean')} its error of the light, "
            f"{_times(eight, four, 'bound_width')} the distance of its bounds."
        )
    sentences.append(_best_estimator(four))
    sentences.append("" if four is None else _saturating(four))
    return [" ".join(filter(None, sentences))]


def _quickest(captures: list[tradeoff.Record]) -> list[str]:
    """Say how soon the error is within a factor of ten and of three of the least there is."""
    errors = {
        index: record.values["range_median_m"]
        for index, record in enumerate(captures)
        if record.values.get("range_median_m")
    }
    if not errors:
        return []
    least_m = min(error for error in errors.values() if error is not None)
    said = []
    for factor in (10, 3):
        first = next(index for index, error in errors.items() if (error or 0) <= factor * least_m)
        record = captures[first]
        said.append(
            f"{short(Sequence.from_document(record.point))} takes "
            f"{_number(record, 'capture_s', 1e3, '{:.0f}')} ms for a median error of "
            f"{_number(record, 'range_median_m', 1e3)} mm"
        )
    return [
        f"The least median error of all is {least_m * 1e3:.2g} mm; the quickest within ten times "
        f"that, {said[0]}; within three times, {said[1]}."
    ]


def _saturating(record: tradeoff.Record) -> str:
    share = record.values.get("saturated") or 0.0
    if share < 0.01:
        return ""
    return f"At 1.92 ms {share:.0%} of the pixels saturate, and their range is not to be trusted."


def _key(record: tradeoff.Record) -> tuple[int, str, float, int]:
    point = record.point
    plain = point["sub_phases"] == {"scheme": "arccos", "n": 8}
    return (
        point["harmonics"] if plain else -1,
        point["zeroth"],
        point["exposure_s"],
        point["takes"],
    )


def _returns_clause(record: tradeoff.Record) -> str:
    right = record.values.get("returns_right")
    return "" if right is None else f" and the right number of returns in {right:.0%} of the pixels"


def _times(one: tradeoff.Record, other: tradeoff.Record, name: str) -> str:
    first, second = one.values.get(name), other.values.get(name)
    if not first or not second:
        return "–"
    return f"{first / second:.2g} x"


def _best_estimator(record: tradeoff.Record | None) -> str:
    """Name the estimator whose range is closest to the truth at m = 4."""
    if record is None:
        return ""
    names = {
        "range_rmse_m": "the first return (Pisarenko)",
        "maximum_entropy_rmse_m": "the first maximum entropy peak",
        "single_frequency_rmse_m": "the phase of a single frequency",
    }
    known = {name: record.values.get(name) for name in names}
    errors = {name: value for name, value in known.items() if value is not None}
    if not errors:
        return ""
    best = min(errors, key=lambda name: errors[name])
    return (
        f"Of one m = 4 capture {names[best]} is closest to the true range "
        f"(RMSE {errors[best] * 1e3:.3g} mm)."
    )


def _computing(records: tradeoff.Records) -> list[str]:
    rows = []
    for record in records:
        point = record.point
        if record.kind == "computing" and record.scene == "mirrors":
            rows.append(
                f"| {point['task']} | {point['method']} | {point['dtype']} | {point['harmonics']} "
                f"| {point.get('bins', '')} | {_number(record, 'seconds', 1e3)} "
                f"± {(record.spread['seconds'] or 0) * 1e3:.1g} "
                f"| {_number(record, 'error_median', 1, '{:.1e}')} "
                f"| {_number(record, 'error_worst', 1, '{:.1e}')} |"
            )
    transported = [
        f"| {record.point['product']} | {record.point['coding']} | {record.point['harmonics']} "
        f"| {record.values['bytes']:,.0f} | {_number(record, 'seconds', 1e3)} "
        f"| {_number(record, 'error_median', 1, '{:.1e}')} "
        f"| {_number(record, 'error_worst', 1, '{:.1e}')} |"
        for record in records
        if record.kind == "transport" and record.scene == "mirrors"
    ]
    return [
        "## Computing time and transport",
        "",
        "Of one 163 x 120 frame of `mirrors`. Errors of ranges are in radian against double "
        "precision (which is its own reference: 0), of densities over the peak and of light over "
        "the brightness, against double precision for float32 and 50 digits for float64.",
        "",
        "| task | method | precision | m | times | ms | typical error | worst error |",
        "|---|---|---|---|---|---|---|---|",
        *rows,
        "",
        "To send that frame: size, time to encode and decode, and what is added to the error, in m "
        "for a range and in shares of the light until any time for a density.",
        "",
        "| product | coding | m | bytes | ms | typical error | worst error |",
        "|---|---|---|---|---|---|---|",
        *transported,
        "",
    ]


def _noise(noise: list[Compared]) -> list[str]:
    rows = [
        f"| {short(each.sequence)} | {each.holds_share:.0%} "
        f"| {np.median(each.predicted_m) * 1e3:.3g} | {np.median(each.observed_m) * 1e3:.3g} "
        f"| {each.ratio:.3f} "
        f"| {np.mean(np.abs(each.observed_m / each.predicted_m - 1) < 0.15):.0%} |"
        for each in noise
        if each.predicted_m.size
    ]
    return [
        "## Is the noise predicted?",
        "",
        f"Pisarenko's on `mirrors`, from sensor and mean moments to each pixel's deviation, "
        f"against {FRAMES} captures, which know a pixel's deviation to 9 % (so that a perfect "
        "prediction has 89 % of the pixels within 15 %). First order holds with as many returns as "
        "harmonics, all clear of the noise and of each other.",
        "",
        "| sequence | holds for | predicted mm | observed mm | rms ratio | within 15 % |",
        "|---|---|---|---|---|---|",
        *rows,
        "",
        "![Observed against predicted noise](figures/noise-prediction.png)",
        "",
    ]


def _stated(stated: list[Stated]) -> list[str]:
    rows = [
        f"| {each.scene} | {each.sequence} | {each.observed_m * 1e3:.3g} "
        f"| {each.product_m * 1e3:.3g} ({each.product_m / each.observed_m:.2f}) "
        f"| {each.metadata_m * 1e3:.3g} ({each.metadata_m / each.observed_m:.2f}) |"
        for each in stated
    ]
    return [
        "## Does a frame know its noise?",
        "",
        f"The default estimator, median pixel: what one frame states, and how {OF_FRAMES} frames "
        "scatter; behind each figure, how often it is the scatter. `range_std` draws the noise of "
        "the sensor. `predicted_range_std_m` is that of the likelihood's returns to first order: "
        "that noise changes their number, or makes a tail of them, is not in it.",
        "",
        "| scene | sequence | scatter mm | `range_std` mm | `predicted_range_std_m` mm |",
        "|---|---|---|---|---|",
        *rows,
        "",
    ]


def _time(scenes: dict[str, str], records: tradeoff.Records) -> list[str]:
    took_s = {
        name: sum(record.took_s for record in records if record.scene == spec)
        for name, spec in scenes.items()
    }
    each = ", ".join(f"{name} {seconds:.0f} s" for name, seconds in took_s.items())
    return [
        "## How long this takes",
        "",
        f"{len(records)} points in {sum(took_s.values()) / 60:.0f} minutes: {each}. Every point is "
        "on the disk before the next one begins: a run that is stopped loses the one it was at.",
    ]
