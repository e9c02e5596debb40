"""Requests and the reading of their answers."""

import json
import math

import numpy as np
import pytest

from transientcam.errors import ParameterError, ProblemError, ProtocolError
from transientcam.requests import Answer, document

_PROBLEM = {
    "type": "/problems/invalid-sequence",
    "title": "Invalid sequence",
    "status": 422,
    "detail": "harmonics is 99, but must be from 1 to 32",
    "field": "harmonics",
    "value": 99,
    "limit": "from 1 to 32",
}


def _json(value: object, *, status: int = 200, media_type: str = "application/json") -> Answer:
    return Answer(status, media_type, json.dumps(value).encode(), "Reason")


def test_numpy_numbers_are_numbers() -> None:
    body = {"takes": np.int64(2), "exposure_s": np.float32(0.5), "x": np.ones(2)}

    request = document("sequence", method="PUT", body=body)

    assert request.body == b'{"takes": 2, "exposure_s": 0.5, "x": [1.0, 1.0]}'


@pytest.mark.parametrize("value", [math.nan, math.inf, np.float32(math.nan), object(), {1j}])
def test_what_json_cannot_carry_is_refused_before_it_is_sent(value: object) -> None:
    with pytest.raises(ParameterError, match="document is"):
        document("sequence", method="PUT", body={"exposure_s": value})


def test_a_refusal_is_raised_with_all_it_says() -> None:
    answer = _json(_PROBLEM, status=422, media_type="application/problem+json")

    with pytest.raises(ProblemError) as caught:
        document("sequence").result(answer)

    error = caught.value
    assert (error.status, error.type) == (422, "/problems/invalid-sequence")
    assert (error.field, error.value, error.limit) == ("harmonics", 99, "from 1 to 32")
    assert error.document == _PROBLEM
    assert str(error) == "harmonics is 99, but must be from 1 to 32 (422)"


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (Answer(502, "text/html", b"<h1>Bad Gateway</h1>", "Bad Gateway"), "Bad Gateway (502)"),
        (Answer(502, "", b"", "Bad Gateway"), "Bad Gateway (502)"),
        (Answer(500, "application/problem+json", b"{", "Broken"), "Broken (500)"),
        (Answer(500, "application/problem+json", b"[]", "Broken"), "Broken (500)"),
        (Answer(500, "text/plain", b"\xff" * 1000, ""), "\N{REPLACEMENT CHARACTER} (500)"),
        (Answer(307, "", b"", "Temporary Redirect"), "Temporary Redirect (307)"),
        (
            _json(
                {"detail": 3, "title": "T", "status": "x"},
                status=400,
                media_type="application/problem+json",
            ),
            "T (400)",
        ),
    ],
)
def test_a_refusal_that_is_no_proper_problem_still_is_one(answer: Answer, words: str) -> None:
    with pytest.raises(ProblemError) as caught:
        document("info").result(answer)

    assert caught.value.status == answer.status
    assert str(caught.value).endswith(words)


@pytest.mark.parametrize(
    ("answer", "field"),
    [
        (Answer(200, "text/html", b"<html>"), "content-type"),
        (Answer(200, "application/json", b"{"), "body"),
        (Answer(200, "application/json", b"\xff"), "body"),
        (Answer(200, "application/json", b"[" * 100_000), "body"),
        (Answer(200, "application/json", b"[1]"), "body"),
        (Answer(204, "", b""), "content-type"),
    ],
)
def test_an_answer_of_another_kind_is_refused(answer: Answer, field: str) -> None:
    with pytest.raises(ProtocolError) as caught:
        document("info").result(answer)

    assert caught.value.field == field
