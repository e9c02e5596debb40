"""Statements hold by limits, and by nothing else."""

import json
import math
from dataclasses import asdict

import pytest

from transientcam_experiments.paper.figure import Table, check, state


@pytest.mark.parametrize(
    ("value", "limits", "passes"),
    [
        (1.0, {"at_most": 1.0}, True),
        (1.1, {"at_most": 1.0}, False),
        (1.0, {"at_least": 1.0}, True),
        (0.9, {"at_least": 1.0}, False),
        (0.5, {"at_least": 0.4, "at_most": 0.6}, True),
        (0.7, {"at_least": 0.4, "at_most": 0.6}, False),
        (math.nan, {"at_most": 1.0}, False),
        (math.nan, {"at_least": 1.0}, False),
    ],
)
def test_a_statement_passes_inside_of_its_limits(
    value: float, limits: dict[str, float], passes: bool
) -> None:
    statement = check("Sec. 1", "says", "measure", value, otherwise="why", **limits)  # type: ignore[arg-type]  # the limits are floats

    assert statement.passes is passes
    assert statement.reason == ("" if passes else "why")


def test_a_statement_shows_its_value_as_its_limits() -> None:
    statement = check("Sec. 1", "says", "measure", 0.123, at_least=0.1, at_most=0.2, form="{:.0%}")

    assert (statement.shown, statement.criterion) == ("12%", "at least 10% and at most 20%")


def test_a_sentence_of_the_file_is_filled_in_and_its_limits_can_be_replaced() -> None:
    stated = state("08.averaging", 3.0, takes=7)
    replaced = state("08.averaging", 3.0, takes=7, at_least=4.0)

    assert stated.measure == "typical difference of two captures at m = 4, one take over 7"
    assert (stated.criterion, stated.passes) == ("at least 2.0", True)
    assert (replaced.criterion, replaced.passes) == ("at least 4.0", False)


def test_documents_hold_plain_values_for_json() -> None:
    statement = check("Sec. 1", "says", "measure", 2.0, at_most=1.0, otherwise="why")

    assert asdict(statement) == {
        "source": "Sec. 1",
        "says": "says",
        "measure": "measure",
        "value": 2.0,
        "shown": "2.00",
        "criterion": "at most 1.00",
        "passes": False,
        "reason": "why",
    }
    assert json.loads(json.dumps(asdict(Table("t", ("a",), ((1.0,),))))) == {
        "title": "t",
        "columns": ["a"],
        "rows": [[1.0]],
    }
