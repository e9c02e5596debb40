"""A verdict is written to JSON and read again; what is none is nothing."""

import math
from typing import Any

import pytest

from transientcam_server.imaging import Verdict
from transientcam_server.imaging._calibrations.verdict import Finding, word_of

FINDINGS = (Finding("unlike_share", 0.1, 0.05, "share"), Finding("offset_m", math.nan, 0.1, "m"))
VERDICT = Verdict("scene", FINDINGS, 8, (".#", "?."), "nominal")


def test_it_is_read_as_it_was_written() -> None:
    document = VERDICT.to_document()

    assert document["tests"][1]["value"] is None
    read = Verdict.from_document(document)
    assert read is not None
    assert read.to_document() == document


@pytest.mark.parametrize(
    "document",
    [
        None,
        "scene",
        {},
        VERDICT.to_document() | {"verdict": "fine"},
        VERDICT.to_document() | {"tests": [{"test": "offset_m"}]},
        VERDICT.to_document() | {"tests": [{"test": "offset_m", "value": [], "limit": 1}]},
        VERDICT.to_document() | {"block_px": "many"},
        VERDICT.to_document() | {"blocks": None},
    ],
)
def test_anything_else_is_no_verdict(document: Any) -> None:
    assert Verdict.from_document(document) is None


@pytest.mark.parametrize(
    ("unlike", "offset_m", "word"),
    [
        (0.0, 0.0, "diffusor"),
        (0.0, 2.0, "in-doubt"),
        (0.0, -2.0, "in-doubt"),
        (0.1, 0.0, "in-doubt"),
        (0.1, 2.0, "scene"),
        (0.3, 0.0, "scene"),
        (math.nan, math.nan, "in-doubt"),
    ],
)
def test_many_unlike_pixels_or_some_far_away_make_a_scene(
    unlike: float, offset_m: float, word: str
) -> None:
    findings = (
        Finding("unlike_share", unlike, 0.05, "share"),
        Finding("offset_m", offset_m, 0.1, "m"),
    )

    assert word_of(findings) == word
