"""The whole tradeoff of `transientcam tradeoff` on every scene: capturing, computing, sending."""

import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

from rich.progress import Progress

import transientcam_moments as tm
from benchmarks.accuracy.capturing import SEED, short
from benchmarks.common.measured_scenes import composite_scene
from benchmarks.common.tables import Column, Table
from transientcam_driver import Sequence as Capture
from transientcam_experiments import tradeoff

SCENES: Final = {
    "wall": "One return a pixel.",
    "corner": "Diffuse light comes back close behind the direct return.",
    "mirrors": "Three sharp returns in most pixels.",
    "visitor": "A person moves before a bright wall while the images are taken.",
}
COMPOSITE: Final = "Three returns of different sharpness, measured with single photons."
COMPUTED: Final = "mirrors"
"""What computing and sending cost is hardly the scene's: it is measured on this one alone."""
REPETITIONS: Final = 5
_PLOTS: Final = {
    "repeatability": "Deviation of the range against capture time",
    "cumulative": "Error of the light against capture time",
}
_QUANTITIES: Final = {
    "capture_s": (1e3, Column("capture ms", ".0f")),
    "range_std_m": (1e3, Column("deviation mm", ".3g")),
    "range_median_m": (1e3, Column("median error mm", ".3g")),
    "range_rmse_m": (1e3, Column("RMSE mm", ".3g")),
    "maximum_entropy_rmse_m": (1e3, Column("peak RMSE mm", ".3g")),
    "single_frequency_rmse_m": (1e3, Column("m = 1 RMSE mm", ".3g")),
    "returns_right": (100.0, Column("returns %", ".0f")),
    "cumulative_mean": (100.0, Column("light %", ".1f")),
    "bound_width": (1.0, Column("bounds", ".3g")),
}


def tables(figures: Path, *, quick: bool = False, output: Path | None = None) -> Iterator[Table]:
    """Measure; ``quick``: few sequences. A run that is given the folder of another goes on there.

    The measured composite needs TRANSIENTCAM_TEST_DATA.
    """
    with tempfile.TemporaryDirectory() as temporary:
        folder = output or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        scenes, said = {name: name for name in SCENES}, dict(SCENES)
        composite = composite_scene(folder)
        if composite is not None:
            scenes["composite"], said["composite"] = composite, COMPOSITE
        records = measured(scenes, folder, "quick" if quick else "paper")
        for name, spec in scenes.items():
            yield _scene(name, spec, records, said[name])
            for plot in _PLOTS:
                drawn = folder / f"{tradeoff.file_name(spec)}-{plot}.png"
                target = figures / f"accuracy-{tradeoff.file_name(spec)}-{plot}.png"
                target.write_bytes(drawn.read_bytes())
        yield _computing(records)
        yield _sending(records)
        took_s = {
            name: sum(each.took_s for each in records if each.scene == spec)
            for name, spec in scenes.items()
        }
        of_each = ", ".join(f"{name} {seconds:.0f} s" for name, seconds in took_s.items())
        took = f"{len(records)} points in {sum(took_s.values()) / 60:.0f} minutes: {of_each}."
        yield Table("How long this takes", text=[took])


def measured(scenes: Mapping[str, str], folder: Path, grid: str) -> tradeoff.Records:
    """Run the whole tradeoff and report it."""
    tm.kernels.compile()
    records, chosen = tradeoff.Records(folder), tradeoff.load_grid(grid)
    for name, spec in scenes.items():
        own = chosen if name == COMPUTED else replace(chosen, harmonics=())
        points = tradeoff.points_of(own, scene=spec, repetitions=REPETITIONS, seed=SEED)
        measure(points, records, scene=spec, seed=SEED)
    tradeoff.report(folder, records)
    return records


def measure(
    points: list[tradeoff.Point], records: tradeoff.Records, *, scene: str, seed: int
) -> None:
    """Measure points of a scene, and show how far that is."""
    with Progress() as progress:
        task = progress.add_task(Path(scene).stem, total=len(points))

        def advance(_: str) -> None:
            progress.advance(task)

        tradeoff.measure(points, records, scene=scene, seed=seed, progress=advance)


def _of(kind: str, scene: str, records: tradeoff.Records) -> list[tradeoff.Record]:
    return [each for each in records if each.kind == kind and each.scene == scene]


def _scene(name: str, spec: str, records: tradeoff.Records, said: str) -> Table:
    captures = sorted(
        _of("capture", spec, records), key=lambda record: record.values["capture_s"] or 0.0
    )
    pictures = " ".join(
        f"![{what}](../figures/accuracy-{tradeoff.file_name(spec)}-{plot}.png)"
        for plot, what in _PLOTS.items()
    )
    return Table(
        name,
        ("sequence", *(column for _, column in _QUANTITIES.values())),
        [
            (
                short(Capture.from_document(record.point)),
                *(scaled(record, name, factor) for name, (factor, _) in _QUANTITIES.items()),
            )
            for record in captures
            if _shown(record)
        ],
        [pictures],
        [f"{said} {_quickest(captures)}".rstrip()],
    )


def _shown(record: tradeoff.Record) -> bool:
    """Whether a capture is in the table: the paper's sub-phases, few takes, two exposures."""
    point = record.point
    usual = point["sub_phases"] == {"scheme": "arccos", "n": 8} and point["takes"] in (1, 4, 20)
    video = (point["zeroth"], point["exposure_s"]) == ("estimated", 0.0005)
    return usual and (point["exposure_s"] == 0.00192 or video)


def scaled(record: tradeoff.Record, name: str, factor: float) -> float | None:
    """Return a value in another unit; None where there is none."""
    value = record.values.get(name)
    return None if value is None else factor * value


def _quickest(captures: list[tradeoff.Record]) -> str:
    """Say how soon the error is within a factor of ten and of three of the least there is."""
    errors_m = [record.values.get("range_median_m") or float("inf") for record in captures]
    least_m = min(errors_m, default=float("inf"))
    if least_m == float("inf"):
        return ""
    said = []
    for factor in (10, 3):
        place = next(n for n, error_m in enumerate(errors_m) if error_m <= factor * least_m)
        sequence = short(Capture.from_document(captures[place].point))
        took_ms = 1e3 * (captures[place].values["capture_s"] or 0.0)
        error_mm = 1e3 * errors_m[place]
        said.append(f"{sequence} takes {took_ms:.0f} ms for a median error of {error_mm:.3g} mm")
    return (
        f"The least median error of all is {least_m * 1e3:.2g} mm; the quickest within ten times "
        f"that, {said[0]}; within three times, {said[1]}."
    )


_ERRORS: Final = (Column("typical error", ".1e"), Column("worst error", ".1e"))


def _errors(record: tradeoff.Record) -> tuple[float | None, ...]:
    return record.values["error_median"], record.values["error_worst"]


def _computing(records: tradeoff.Records) -> Table:
    text = (
        f"Of one 163 x 120 frame of `{COMPUTED}`. Errors of ranges are in radian against double "
        "precision (which is its own reference: 0), of densities over the peak and of light over "
        "the brightness, against double precision for float32 and 50 digits for float64."
    )
    rows = [
        (
            *(record.point[name] for name in ("task", "method", "dtype", "harmonics")),
            record.point.get("bins", ""),
            f"{1e3 * (record.values['seconds'] or 0):.3g} "
            f"± {1e3 * (record.spread['seconds'] or 0):.1g}",
            *_errors(record),
        )
        for record in _of("computing", COMPUTED, records)
    ]
    columns = ("task", "method", "precision", "m", "times", "ms", *_ERRORS)
    return Table("Computing time and transport", columns, rows, text=[text])


def _sending(records: tradeoff.Records) -> Table:
    text = (
        "To send that frame: size, time to encode and decode, and what is added to the error, in m "
        "for a range and in shares of the light until any time for a density."
    )
    rows = [
        (
            *(record.point[name] for name in ("product", "coding", "harmonics")),
            record.values["bytes"],
            scaled(record, "seconds", 1e3),
            *_errors(record),
        )
        for record in _of("transport", COMPUTED, records)
    ]
    numbers = Column("bytes", ",.0f"), Column("ms", ".3g"), *_ERRORS
    return Table("", ("product", "coding", "m", *numbers), rows, text=[text])
