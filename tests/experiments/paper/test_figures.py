"""Every figure is made, at a small size, and says what it measured."""

import math

import pytest

from transientcam_experiments.paper import FIGURES, Bench, figure11, figure12, style
from transientcam_experiments.paper.contenders import CONTENDERS, PRINTED
from transientcam_experiments.paper.figure import FigureResult
from transientcam_experiments.paper.figure12 import ENTRIES

PAPERS = (2, 3, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)
HOLD_EVEN_QUICKLY = {
    2: ("exactly", "known to be a positive", "reciprocal"),
    3: ("For n = 8", "perfect sinusoidal", "free of harmonic", "measurement times"),
    5: ("nearly sparse", "governs sparsity", "continuously"),
    6: ("separated clearly",),
    7: ("ground truth is known", "holds for our reconstruction", "Any density", "sharp."),
    8: ("capture rates", "sharper peaks"),
    9: ("smeared out", "quadrature"),
    10: ("very sharp", "0.22 Hz"),
    11: (
        "excellent reconstruction of the sparse case without noise (all",
        "adequately reconstructs",
    ),
    12: ("severe distortions", "reduces distortions heavily", "2.2 Hz"),
    13: ("18.6 Hz", "first returns from the actor"),
    14: ("separated from direct", "free of multipath", "zeroth moment"),
    15: ("temporally close", "distinct peaks"),
}
"""Words of statements that no number of takes can change."""


def test_every_figure_of_the_paper_that_shows_results_is_there() -> None:
    assert tuple(FIGURES) == PAPERS
    assert all(FIGURES[number].number == number for number in PAPERS)


@pytest.fixture
def made(
    bench: Bench, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> FigureResult:
    # tables and linear programs of many pixels take their time
    quick = tuple(each for each in CONTENDERS if each.name in PRINTED)
    monkeypatch.setattr(figure11, "CONTENDERS", quick)
    monkeypatch.setattr(figure12, "ENTRIES", ENTRIES[:6])
    return FIGURES[request.param].make(bench)


@pytest.mark.parametrize(("made", "number"), [(n, n) for n in PAPERS], indirect=["made"])
def test_a_figure_has_a_picture_statements_and_a_table(made: FigureResult, number: int) -> None:
    assert style.png(made.picture).startswith(b"\x89PNG")
    assert len(made.statements) >= 2
    for statement in made.statements:
        assert statement.source.startswith(("Fig.", "Sec."))
        assert statement.says.endswith((".", ")"))
        assert math.isfinite(statement.value)
    assert made.tables
    for table in made.tables:
        assert table.rows
        assert all(len(row) == len(table.columns) for row in table.rows)
    for words in HOLD_EVEN_QUICKLY[number]:
        (found,) = (each for each in made.statements if words in each.says)
        assert found.passes, (found.says, found.shown)
