"""One HTML page of all results: no other file, no other host."""

import html
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from string import Template
from typing import Any, Final

from transientcam_experiments.tradeoff import capture, computing, estimating, transport
from transientcam_experiments.tradeoff.plots import PLOTS, draw, point_id
from transientcam_experiments.tradeoff.records import Record, Records, write_csv

_QUANTITIES: Final = {
    "capture": capture.QUANTITIES,
    "computing": computing.QUANTITIES,
    "estimating": estimating.QUANTITIES,
    "transport": transport.QUANTITIES,
}
_TITLES: Final = {
    "capture": "Capture time",
    "computing": "Computing time",
    "estimating": "Estimators of range",
    "transport": "Transport",
}


def page(records: Iterable[Record], plots: Mapping[tuple[str, str], bytes]) -> str:
    """Return the page.

    ``records``: the results.
    ``plots``: SVG by scene and name of the plot.
    """
    results = list(records)
    sections = []
    for scene in dict.fromkeys(record.scene for record in results):
        of_scene = [record for record in results if record.scene == scene]
        sections += [f"<h2>{html.escape(scene)}</h2>", *_section(scene, of_scene, plots)]
    template = Path(__file__).with_suffix(".html").read_text("utf-8").rstrip("\n")
    return Template(template).substitute(sections="\n".join(sections))


def _section(
    scene: str, records: list[Record], plots: Mapping[tuple[str, str], bytes]
) -> Iterable[str]:
    for kind, title in _TITLES.items():
        mine = [record for record in records if record.kind == kind]
        if not mine:
            continue
        yield f"<h3>{title}</h3><div class=plots>"
        for name, axes in PLOTS.items():
            svg = plots.get((scene, name))
            if axes.kind == kind and svg is not None:
                yield _inline(svg, f"{scene}-{name}", mine)
        yield "</div>"
        yield _table(mine, _QUANTITIES[kind])
        yield "<dl>"
        for name, meaning in _QUANTITIES[kind].items():
            yield f"<dt>{name}<dd>{html.escape(meaning)}"
        yield "</dl>"


def _inline(svg: bytes, prefix: str, records: list[Record]) -> str:
    """Put a picture into the page, its ids made its own and its points named."""
    text = svg.decode()
    text = text[text.index("<svg") :]
    for reference in ('id="', 'href="#', "url(#"):
        text = text.replace(reference, f"{reference}{prefix}-")
    for record in records:
        known = point_id(record)
        label = html.escape(_what(record))
        text = text.replace(
            f'<g id="{prefix}-{known}">',
            f'<g id="p-{prefix}-{known}" data-point="{known}"><title>{label}</title>',
        )
    return text


def _what(record: Record) -> str:
    """Return the settings of a point as text."""
    point = dict(record.point)
    if record.kind != "capture":
        return ", ".join(_setting(name, value) for name, value in point.items())
    sub_phases = point["sub_phases"]
    of_exposure = sub_phases["scheme"]
    if of_exposure != "none":
        of_exposure += f" {sub_phases['n']}"
    takes = "1 take" if point["takes"] == 1 else f"{point['takes']} takes"
    return (
        f"m = {point['harmonics']}, {point['base_frequency_hz'] / 1e6:g} MHz, "
        f"{point['exposure_s'] * 1e3:g} ms, {takes}, {point['zeroth']}, "
        f"{of_exposure}"
    )


def _setting(name: str, value: Any) -> str:
    if name == "harmonics":
        return f"m = {value}"
    return f"{value} bins" if name == "bins" else str(value)


def _table(records: list[Record], quantities: Mapping[str, str]) -> str:
    shown = [name for name in quantities if any(record.values.get(name) for record in records)]
    copyable = records[0].kind == "capture"
    head = "".join(f"<th title='{html.escape(quantities[name])}'>{name}" for name in shown)
    rows = [f"<div class=table><table><tr><th>{'<th>' if copyable else ''}{head}"]
    for record in records:
        cells = "".join(
            f"<td>{_number(record.values.get(name), record.spread.get(name))}" for name in shown
        )
        body = html.escape(json.dumps(record.point), quote=True)
        data = f' data-sequence="{body}"' if copyable else ""
        button = "<td><button class=copy>Copy</button>" if copyable else ""
        rows.append(
            f'<tr id="row-{point_id(record)}"{data}><td>{html.escape(_what(record))}{button}{cells}'
        )
    return "\n".join([*rows, "</table></div>"])


def _number(value: float | None, spread: float | None) -> str:
    if value is None:
        return "–"
    shown = f"{value:,.0f}" if abs(value) >= 1e4 else f"{value:.4g}"
    return f"{shown} <small>±{spread:.1g}</small>" if spread else shown


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
