import json
import re
from enum import Enum
from typing import Annotated

import pytest
from fastapi.exceptions import RequestValidationError
from pydantic import AfterValidator, BaseModel, Field, ValidationError

from transientcam.errors import ProtocolError
from transientcam_driver import CameraFault, CameraLost, CameraNotFound, FrameTimeout, SequenceError
from transientcam_server.api import problem_response
from transientcam_server.api._problems import _of_validation, documented
from transientcam_server.errors import Problem, kinds, problem_document, problem_of


@pytest.mark.parametrize(
    ("error", "slug", "status"),
    [
        (SequenceError("harmonics", 99, "at most 32"), "invalid-sequence", 422),
        (CameraLost("unplugged"), "camera-lost", 503),
        (CameraNotFound("SIM-1"), "camera-lost", 503),
        (CameraFault("the interlock was opened"), "camera-failed", 502),
        (FrameTimeout(1.0), "camera-failed", 502),
        (ProtocolError("type", 5, "a string"), "bad-message", 422),
        (ZeroDivisionError("secret"), "internal-error", 500),
        (Problem(kinds.NOT_FOUND, "x"), "not-found", 404),
    ],
)
def test_every_error_of_this_project_has_its_problem(
    error: Exception, slug: str, status: int
) -> None:
    problem = problem_of(error)

    assert (problem.kind.slug, problem.kind.status) == (slug, status)


def test_a_refused_value_is_reported_as_field_value_and_limit() -> None:
    document = problem_document(
        problem_of(SequenceError("harmonics", 99, "at most 32")), instance="/api/v1/sequence"
    )

    assert document == {
        "type": "/problems/invalid-sequence",
        "title": kinds.INVALID_SEQUENCE.title,
        "status": 422,
        "detail": "harmonics = 99: must be at most 32",
        "instance": "/api/v1/sequence",
        "field": "harmonics",
        "value": 99,
        "limit": "at most 32",
    }


def test_what_went_wrong_inside_is_not_reported_outside() -> None:
    assert "secret" not in json.dumps(problem_document(problem_of(ZeroDivisionError("secret"))))


@pytest.mark.parametrize(
    "value",
    [
        float("nan"),
        float("inf"),
        "x" * 100_000,
        list(range(10_000)),
        {1: float("nan")},
        b"\xff",
        1j,
    ],
)
def test_any_refused_value_can_be_reported_as_short_json(value: object) -> None:
    response = problem_response(Problem(kinds.INVALID_REQUEST, "no", value=value))

    assert response.headers["content-type"] == "application/problem+json"
    assert len(response.body) < 2000
    json.loads(bytes(response.body))


@pytest.mark.parametrize(
    ("error", "field", "limit"),
    [
        ({"type": "missing", "loc": ("query", "x"), "input": None}, "x", "given"),
        (
            {
                "type": "less_than_equal",
                "loc": ("query", "bins"),
                "input": 5000,
                "msg": "Input should be less than or equal to 9",
            },
            "bins",
            "at most 9",
        ),
        (
            {"type": "json_invalid", "loc": ("body", 3), "input": {}, "ctx": {}},
            "body",
            "valid JSON",
        ),
        ({"type": "made_up", "loc": ("body", "a", 0), "input": 1, "msg": "no"}, "a.0", "no"),
    ],
)
def test_a_request_that_cannot_be_read_names_field_and_limit(
    error: dict[str, object], field: str, limit: str
) -> None:
    problem = _of_validation(RequestValidationError([error]))

    assert problem.extensions["field"] == field
    assert str(problem.extensions["limit"]).startswith(limit)


def printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError("must be text that can be printed")
    return text


class Colour(Enum):
    RED = "red"
    BLUE = "blue"


class Labels(BaseModel):
    name: Annotated[str, Field(max_length=8), AfterValidator(printable)] = ""
    colour: Colour = Colour.RED


@pytest.mark.parametrize(
    ("given", "detail"),
    [
        ({"name": "a\tb"}, r"name is 'a\tb', but must be text that can be printed"),
        ({"name": "x" * 9}, "name is 'xxxxxxxxx', but must be at most 8 characters"),
        ({"name": 7}, "name is 7, but must be a valid string"),
        ({"colour": "green"}, "colour is 'green', but must be 'red' or 'blue'"),
    ],
)
def test_what_pydantic_refuses_is_reported_in_a_sentence(
    given: dict[str, object], detail: str
) -> None:
    with pytest.raises(ValidationError) as refused:
        Labels.model_validate(given)
    (mistake,) = refused.value.errors()

    problem = _of_validation(
        RequestValidationError([{**mistake, "loc": ("body", *mistake["loc"])}])
    )

    assert problem.detail == detail


def test_several_mistakes_are_all_listed() -> None:
    errors = [{"type": "missing", "loc": ("query", name), "input": None} for name in "xy"]

    problem = _of_validation(RequestValidationError(errors))

    mistakes = problem.extensions["errors"]
    assert isinstance(mistakes, list)
    assert [mistake["field"] for mistake in mistakes] == ["x", "y"]


def test_slugs_are_unique_and_fit_for_a_url() -> None:
    for slug, kind in kinds.KINDS.items():
        assert re.fullmatch(r"[a-z][a-z-]+", slug)
        assert kind.type == f"/problems/{slug}"
        assert 400 <= kind.status < 600
        assert kind.meaning.endswith(".")
    assert len(kinds.KINDS) >= 20


def test_kinds_with_one_status_share_its_documentation() -> None:
    responses = documented(kinds.INVALID_REQUEST, kinds.INVALID_SEQUENCE)

    examples = responses[422]["content"]["application/problem+json"]["examples"]
    assert set(examples) == {"invalid-request", "invalid-sequence"}


def test_what_is_nested_deeply_is_shown_in_part() -> None:
    value: object = 1
    for _ in range(5000):
        value = {"x": value}

    shown = problem_document(Problem(kinds.INVALID_REQUEST, "x", value=value))["value"]

    text = json.dumps(shown)
    assert text.startswith('{"x": {"x": ')
    assert len(text) < 200
