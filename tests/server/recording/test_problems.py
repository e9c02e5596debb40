"""What is refused of a client's annotations, and the problems of recordings."""

import json
from pathlib import Path
from typing import Any

import pytest

from transientcam_server.errors import Problem
from transientcam_server.recording._problems import (
    not_stored,
    require_annotations,
    unfinished,
    unknown,
)


def nested(levels: int) -> dict[str, Any]:
    """Maps in lists in maps, so many levels in all."""
    value: Any = 1
    for level in reversed(range(levels)):
        value = {"k": value} if level % 2 == 0 else [value]
    found: dict[str, Any] = value
    return found


def long(size_bytes: int) -> dict[str, Any]:
    """A map of so many bytes as JSON without blanks."""
    empty = len(json.dumps({"k": ""}, separators=(",", ":")))
    return {"k": "x" * (size_bytes - empty)}


@pytest.mark.parametrize("annotations", [{}, {"k": None}, nested(64), long(16384)])
def test_annotations_are_taken_up_to_their_limits(annotations: dict[str, Any]) -> None:
    require_annotations(annotations)


@pytest.mark.parametrize(
    ("annotations", "value", "limit"),
    [
        (nested(65), None, "JSON of at most 64 levels"),
        (nested(100_000), None, "JSON of at most 64 levels"),
        ({"k": float("nan")}, None, "JSON of at most 64 levels"),
        ({"k": "\ud800"}, None, "JSON of at most 64 levels"),
        (long(16385), 16385, "at most 16384 bytes"),
    ],
)
def test_other_annotations_are_refused_with_the_limit(
    annotations: dict[str, Any], value: int | None, limit: str
) -> None:
    with pytest.raises(Problem) as caught:
        require_annotations(annotations)

    assert caught.value.kind.slug == "invalid-request"
    assert caught.value.extensions["field"] == "annotations"
    assert caught.value.extensions["limit"] == limit
    assert caught.value.extensions.get("value") == value


@pytest.mark.parametrize("length", [0, 63, 64, 65, 5000])
def test_of_an_unknown_id_no_more_than_64_characters_are_sent_back(length: int) -> None:
    problem = unknown("x" * length)

    assert problem.extensions["value"] == "x" * min(length, 64)
    assert repr("x" * min(length, 64)) in problem.detail


def test_what_is_not_finished_or_not_stored_is_said() -> None:
    assert unfinished("a").extensions["recording"] == "a"
    error = not_stored(Path("recordings"), OSError(28, "No space left on device"))
    assert error.detail == "It could not be written: No space left on device."
