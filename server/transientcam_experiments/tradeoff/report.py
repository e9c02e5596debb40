"""Tables, plots and the page of the results so far."""

from pathlib import Path

from transientcam_experiments.tradeoff.page import page
from transientcam_experiments.tradeoff.plots import PLOTS, draw
from transientcam_experiments.tradeoff.records import Records, write_csv


def report(folder: Path, records: Records) -> list[Path]:
    """Write a .csv a price, plots as PNG and SVG, and ``index.html``; return them all."""
    written, plots = [], {}
    for kind in dict.fromkeys(record.kind for record in records):
        path = folder / f"{kind}.csv"
        write_csv(path, (record for record in records if record.kind == kind))
        written.append(path)
    for scene in dict.fromkeys(record.scene for record in records):
        for name, axes in PLOTS.items():
            images = draw(axes, scene, records)
            if images is None:
                continue
            plots[scene, name] = images["svg"]
            for suffix, data in images.items():
                path = folder / f"{file_name(scene)}-{name}.{suffix}"
                path.write_bytes(data)
                written.append(path)
    path = folder / "index.html"
    path.write_text(page(records, plots), encoding="utf-8")
    return [*written, path]


def file_name(scene: str) -> str:
    """Return a scene's name as part of a file's."""
    stem = Path(scene.partition("?")[0]).stem
    return "".join(each if each.isalnum() or each in "-_" else "-" for each in stem)
