"""The output for all figures: pictures, one JSON document, and a page in Markdown."""

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from transientcam_experiments.paper.figure import FigureResult, PaperFigure

PAGE: Final = "paper.md"
FOLDER: Final = Path("figures") / "paper"
DOCUMENT: Final = "paper.json"
_NOTHING: Final = 1e-9
"""Smaller values are rounding errors, and shown as 0."""
_PAPER: Final = "https://doi.org/10.1145/2816795.2818103"


def picture_name(number: int) -> str:
    """Return the name of a figure's picture in `FOLDER`."""
    return f"figure-{number:02d}.png"


def document_of(
    figure: PaperFigure, made: FigureResult, *, seconds: float, quick: bool, seed: int
) -> dict[str, Any]:
    """Return everything about a figure but its picture, for JSON."""
    return {
        "figure": figure.number,
        "title": figure.title,
        "caption": figure.caption,
        "picture": str(FOLDER / picture_name(figure.number)),
        "statements": [asdict(each) for each in made.statements],
        "tables": [asdict(each) for each in made.tables],
        "remarks": list(made.remarks),
        "seconds": round(seconds, 1),
        "quick": quick,
        "seed": seed,
    }


class Page:
    """The page in a folder, with all figures that were ever made there.

    ``folder``: gets the page, ``figures/paper`` with a picture a figure, and a JSON document of all
    numbers beside the pictures.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.path = folder / PAGE
        self._document = folder / FOLDER / DOCUMENT
        self._figures: dict[int, dict[str, Any]] = {}
        if self._document.exists():
            known = json.loads(self._document.read_text(encoding="utf-8"))
            self._figures = {each["figure"]: each for each in known}

    def add(self, document: dict[str, Any], picture: bytes) -> None:
        """Write a figure's picture, and document and page anew."""
        self._figures[document["figure"]] = document
        path = self.folder / document["picture"]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(picture)
        figures = [self._figures[number] for number in sorted(self._figures)]
        text = json.dumps(figures, indent=1, ensure_ascii=False)
        self._document.write_text(text + "\n", encoding="utf-8")
        self.path.write_text(markdown(figures), encoding="utf-8")


def markdown(figures: list[dict[str, Any]]) -> str:
    """Return the page of figures' documents."""
    return (
        "\n".join([*_head(figures), *(line for each in figures for line in _figure(each))]) + "\n"
    )


def _head(figures: list[dict[str, Any]]) -> Iterator[str]:
    every = [statement for each in figures for statement in each["statements"]]
    hold = sum(statement["passes"] for statement in every)
    seconds = sum(each["seconds"] for each in figures)
    quick = " --quick" if any(each["quick"] for each in figures) else ""
    yield "# The paper, figure by figure"
    yield ""
    yield f"Written by `transientcam paper{quick} -o FOLDER`; `make paper` writes it into docs/."
    yield f"Captures, reconstruction and drawing took {seconds:.0f} s of processor time."
    yield ""
    yield (
        f"The figures of [Peters et al. 2015]({_PAPER}), made by this software. Every capture "
        "comes from the simulated camera over its emulated USB, with the errors of the paper's "
        "model of device, after warm-up and with a calibration measured as in Sec. 4.2; figures 5, "
        "7 and 11 are synthetic, as in the paper. Figures 1 and 4 of the paper show its set-up."
    )
    yield ""
    yield (
        "Beside each figure stands what the paper says about it in words, made checkable: what "
        "was measured here, what it should be, and whether it is. Measures and limits are ours; "
        f"the paper prints few numbers. {hold} of {len(every)} statements hold. Where one does "
        "not, the reason is given below the table: the simulated scenes are like the paper's, not "
        "the same."
    )
    yield ""
    yield "| figure | | statements that hold | processor seconds |"
    yield "|---|---|---|---|"
    for each in figures:
        own = [statement["passes"] for statement in each["statements"]]
        link = f"[{each['figure']}](#{_anchor(each)})"
        yield f"| {link} | {each['title']} | {sum(own)} of {len(own)} | {each['seconds']:.0f} |"
    yield ""


def _heading(figure: dict[str, Any]) -> str:
    return f"Figure {figure['figure']}: {figure['title']}"


def _anchor(figure: dict[str, Any]) -> str:
    kept = "".join(each for each in _heading(figure).lower() if each.isalnum() or each in " -")
    return kept.replace(" ", "-")


def _figure(figure: dict[str, Any]) -> Iterator[str]:
    yield f"## {_heading(figure)}"
    yield ""
    yield figure["caption"]
    yield ""
    yield f"![{_heading(figure)}]({figure['picture']})"
    yield ""
    yield "| the paper says | measured here | should be | is | |"
    yield "|---|---|---|---|---|"
    for each in figure["statements"]:
        verdict = "holds" if each["passes"] else "**differs**"
        says = f"{each['says']} ({each['source']})"
        cells = (says, each["measure"], each["criterion"], each["shown"], verdict)
        yield f"| {' | '.join(map(_plain, cells))} |"
    yield ""
    notes = [
        f"**Differs:** “{each['says']}” ({each['shown']}): {each['reason']}."
        for each in figure["statements"]
        if not each["passes"]
    ]
    notes += figure["remarks"]
    if notes:
        yield from (f"- {note}" for note in notes)
        yield ""
    for table in figure["tables"]:
        yield from _table(table)


def _table(table: dict[str, Any]) -> Iterator[str]:
    yield f"{table['title']}:"
    yield ""
    yield f"| {' | '.join(map(_plain, table['columns']))} |"
    yield "|" + "---|" * len(table["columns"])
    for row in table["rows"]:
        yield f"| {' | '.join(_plain(_shown(cell)) for cell in row)} |"
    yield ""


def _shown(cell: Any) -> str:
    if cell is None or (isinstance(cell, float) and cell != cell):
        return "–"
    if isinstance(cell, float):
        if abs(cell) >= 1000:
            return f"{cell:,.0f}"
        return f"{cell:.3g}" if abs(cell) > _NOTHING else "0"
    return str(cell)


def _plain(text: str) -> str:
    """Keep a text from ending its cell."""
    return text.replace("|", "\\|")
