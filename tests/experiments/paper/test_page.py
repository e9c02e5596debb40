"""The page of all figures, and the one that is in docs/."""

import json
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

from transientcam_experiments.paper import FIGURES, FigureResult, PaperFigure, Table, page
from transientcam_experiments.paper.figure import check

DOCS = Path(__file__).parents[3] / "docs"


def _document(number: int, *, value: float = 1.0) -> dict[str, Any]:
    made = FigureResult(
        Figure(),
        (check("Sec. 1", "It is | so.", "how | much", value, at_most=2.0, otherwise="because"),),
        (Table("A table", ("a|b", "c"), (("x|y", 1234.5), (3, None), (0.12345, float("nan")))),),
        ("A remark.",),
    )
    figure = PaperFigure(number, f"Title {number}, of it", "A caption.", lambda bench: made)
    return page.document_of(figure, made, seconds=1.23, quick=False, seed=1)


def test_a_page_has_each_figure_with_its_picture_statements_and_tables() -> None:
    text = page.markdown([_document(2), _document(7, value=3.0)])

    lines = text.splitlines()
    assert "| [7](#figure-7-title-7-of-it) | Title 7, of it | 0 of 1 | 1 |" in lines
    assert "## Figure 7: Title 7, of it" in lines
    assert "![Figure 2: Title 2, of it](figures/paper/figure-02.png)" in lines
    assert r"| It is \| so. (Sec. 1) | how \| much | at most 2.00 | 1.00 | holds |" in lines
    assert r"| It is \| so. (Sec. 1) | how \| much | at most 2.00 | 3.00 | **differs** |" in lines
    assert "- **Differs:** “It is | so.” (3.00): because." in lines
    assert "- A remark." in lines
    assert [line for line in lines if line.startswith((r"| x\|y", "| 3 | –", "| 0.123"))] == [
        r"| x\|y | 1,234 |",
        "| 3 | – |",
        "| 0.123 | – |",
    ] * 2
    assert "1 of 2 statements hold." in text


def test_figures_made_before_stay_on_the_page(tmp_path: Path) -> None:
    page.Page(tmp_path).add(_document(7), b"seven")
    page.Page(tmp_path).add(_document(2), b"two")

    again = page.Page(tmp_path)
    again.add(_document(7, value=3.0), b"new")

    folder = tmp_path / "figures" / "paper"
    assert (folder / "figure-02.png").read_bytes() == b"two"
    assert (folder / "figure-07.png").read_bytes() == b"new"
    known = json.loads((folder / "paper.json").read_text(encoding="utf-8"))
    assert [each["figure"] for each in known] == [2, 7]
    assert again.path.read_text(encoding="utf-8") == page.markdown(known)


@pytest.fixture(scope="module")
def documented() -> list[dict[str, Any]]:
    path = DOCS / page.FOLDER / page.DOCUMENT
    figures: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))
    return figures


def test_the_page_in_the_documentation_is_what_its_numbers_make(
    documented: list[dict[str, Any]],
) -> None:
    assert [each["figure"] for each in documented] == list(FIGURES)
    assert not any(each["quick"] for each in documented)
    assert (DOCS / page.PAGE).read_text(encoding="utf-8") == page.markdown(documented)
    for each in documented:
        assert (DOCS / each["picture"]).read_bytes().startswith(b"\x89PNG")


def test_every_statement_in_the_documentation_that_differs_says_why(
    documented: list[dict[str, Any]],
) -> None:
    silent = [
        (each["figure"], statement["says"])
        for each in documented
        for statement in each["statements"]
        if not statement["passes"] and not statement["reason"]
    ]

    assert not silent
