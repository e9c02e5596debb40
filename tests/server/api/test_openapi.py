"""The interface describes itself completely, and its examples are true."""

from collections.abc import Iterator
from typing import Any

import httpx
import pytest

from tests.server.contract import find_operation, validate
from tests.serving import Served
from transientcam_server.api._documents.document import EXAMPLES
from transientcam_server.errors._kinds import KINDS

PROBLEM = "application/problem+json"


@pytest.fixture(scope="module")
def document(steady_daemon: Served) -> dict[str, Any]:
    openapi: dict[str, Any] = steady_daemon.app.openapi()
    return openapi


def operations(document: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            yield f"{method.upper()} {path}", operation


def test_every_resource_of_the_interface_is_described(document: dict[str, Any]) -> None:
    assert {name for name, _ in operations(document)} == {
        "GET /api/versions",
        "GET /api/v1/info",
        "GET /api/v1/camera",
        "GET /api/v1/camera/choices",
        "PUT /api/v1/camera",
        "POST /api/v1/series/jobs",
        "GET /api/v1/cameras",
        "GET /api/v1/sequence",
        "PUT /api/v1/sequence",
        "POST /api/v1/sequence/validate",
        "GET /api/v1/reconstruction",
        "PUT /api/v1/reconstruction",
        "GET /api/v1/calibrations",
        "POST /api/v1/calibrations",
        "GET /api/v1/calibrations/active",
        "PUT /api/v1/calibrations/active",
        "POST /api/v1/calibrations/active/undo",
        "POST /api/v1/calibrations/import",
        "GET /api/v1/calibrations/{calibration}",
        "DELETE /api/v1/calibrations/{calibration}",
        "GET /api/v1/calibrations/{calibration}/file",
        "GET /api/v1/parameters",
        "GET /api/v1/jobs",
        "GET /api/v1/jobs/{job}",
        "GET /api/v1/jobs/{job}/map.{form}",
        "POST /api/v1/jobs/{job}/cancel",
        "GET /api/v1/acquisition",
        "PUT /api/v1/acquisition",
        "GET /api/v1/frames",
        "GET /api/v1/frames/{frame}",
        "GET /api/v1/frames/{frame}/pixel",
        "GET /api/v1/frames/{frame}/pixel.csv",
        "GET /api/v1/frames/{frame}/{product}",
        "GET /api/v1/preview.mjpeg",
        "GET /api/v1/recordings",
        "POST /api/v1/recordings",
        "POST /api/v1/recordings/import",
        "GET /api/v1/recordings/{recording}",
        "PATCH /api/v1/recordings/{recording}",
        "DELETE /api/v1/recordings/{recording}",
        "POST /api/v1/recordings/{recording}/stop",
        "GET /api/v1/recordings/{recording}/file",
        "GET /api/v1/recordings/{recording}/zarr/{document}",
        "GET /api/v1/recordings/{recording}/zarr/{array}/{part}",
        "GET /api/v1/recordings/{recording}/frames",
        "GET /api/v1/recordings/{recording}/frames/{frame}",
        "GET /api/v1/recordings/{recording}/frames/{frame}/pixel",
        "GET /api/v1/recordings/{recording}/frames/{frame}/pixel.csv",
        "GET /api/v1/recordings/{recording}/frames/{frame}/{product}",
        "GET /api/v1/products",
        "GET /api/v1/products/{store}/zarr/{document}",
        "GET /api/v1/products/{store}/zarr/{array}/{document}",
        "GET /api/v1/products/{store}/zarr/{array}/c/{chunk}",
        "GET /api/v1/simulation",
        "PUT /api/v1/simulation",
        "GET /api/v1/simulation/explain",
        "POST /api/v1/simulation/faults",
        "GET /api/v1/lease",
        "POST /api/v1/lease",
        "PUT /api/v1/lease",
        "DELETE /api/v1/lease",
        "POST /api/v1/acquisition/safe-off",
        "POST /api/v1/plan",
        "POST /api/v1/plan/jobs",
        "GET /api/v1/tradeoff",
        "POST /api/v1/tradeoff/jobs",
        "GET /livez",
        "GET /metrics",
        "GET /readyz",
    }


def test_every_operation_says_what_it_is_for(document: dict[str, Any]) -> None:
    for name, operation in operations(document):
        assert operation["summary"], name
        assert operation["description"].endswith("."), name
        assert operation["tags"], name


def test_every_parameter_is_described_and_its_example_fits(document: dict[str, Any]) -> None:
    for name, operation in operations(document):
        for parameter in operation.get("parameters", []):
            assert parameter["description"], (name, parameter["name"])
            schema = parameter["schema"]
            examples = schema.get("examples", [])
            if parameter["required"]:
                assert examples, (name, parameter["name"])
            for example in examples:
                validate(document, schema, example)


def test_every_body_has_an_example_that_fits(document: dict[str, Any]) -> None:
    for name, operation in operations(document):
        for content in operation.get("requestBody", {}).get("content", {}).values():
            schema = content["schema"]
            examples = [each["value"] for each in content.get("examples", {}).values()]
            examples += resolved(document, schema).get("examples", [])
            assert examples, name
            for example in examples:
                validate(document, schema, example)


def test_every_answer_has_an_example_that_fits(document: dict[str, Any]) -> None:
    for name, operation in operations(document):
        for status, response in operation["responses"].items():
            assert response["description"], (name, status)
            for media_type, content in response["content"].items():
                if not media_type.endswith("json"):
                    continue
                schema = content["schema"]
                examples = [each["value"] for each in content.get("examples", {}).values()]
                examples += resolved(document, schema).get("examples", [])
                assert examples, (name, status)
                for example in examples:
                    validate(document, schema, example)


def test_each_captured_example_is_of_one_described_document(document: dict[str, Any]) -> None:
    assert EXAMPLES.keys() <= document["components"]["schemas"].keys()


def test_every_error_is_described_as_a_problem_with_its_kinds(document: dict[str, Any]) -> None:
    for name, operation in operations(document):
        for status, response in operation["responses"].items():
            if status < "400":
                continue
            assert list(response["content"]) == [PROBLEM], (name, status)
            for slug, example in response["content"][PROBLEM]["examples"].items():
                assert KINDS[slug].status == int(status), (name, slug)
                assert example["value"]["type"] == KINDS[slug].type


def test_what_takes_input_says_how_it_refuses_it(document: dict[str, Any]) -> None:
    for name, operation in operations(document):
        if operation.get("parameters") or operation.get("requestBody"):
            assert "422" in operation["responses"], name


def test_every_field_of_every_document_is_described_or_speaks_for_itself(
    document: dict[str, Any],
) -> None:
    for name, schema in document["components"]["schemas"].items():
        assert schema.get("description"), name


def test_the_contract_finds_operations_by_path(document: dict[str, Any]) -> None:
    def summary(path: str) -> str | None:
        operation = find_operation(document, path, "GET")
        return None if operation is None else operation["summary"]

    assert summary("/api/v1/frames/latest/range.npy") == "A product of a frame"
    assert summary("/api/v1/frames/latest/pixel") == "Everything about one pixel"
    assert summary("/api/v1/nothing") is None


def resolved(document: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    reference = schema.get("$ref")
    if reference is None:
        return schema
    found: Any = document
    for part in reference.removeprefix("#/").split("/"):
        found = found[part]
    assert isinstance(found, dict)
    return found


def bounds(schema: dict[str, Any]) -> Iterator[tuple[dict[str, Any], bool]]:
    """Yield bodies at each limit of a schema and beyond it, and whether it has them."""
    for name, field in schema["properties"].items():
        if "properties" in field:
            yield from (({name: body}, fits) for body, fits in bounds(field))
        for limit, beyond in (("minimum", -1), ("maximum", 1)):
            if limit in field:
                whole = field["type"] == "integer"
                at = int(field[limit]) if whole else field[limit]
                yield {name: at}, True
                yield {name: at + beyond * (1 if whole else at * 1e-3)}, False
        for value in field.get("enum", ()):
            yield {name: value}, True
    yield {"unheard_of": 1}, False


def test_a_sequence_at_the_limits_that_are_stated_is_accepted_and_beyond_refused(
    document: dict[str, Any], steady_daemon: Served
) -> None:
    operation = document["paths"]["/api/v1/sequence/validate"]["post"]
    schema = operation["requestBody"]["content"]["application/json"]["schema"]
    least = {"harmonics": 1, "zeroth": "estimated"}  # leave room for the frequency and the takes
    tried = list(bounds(schema))
    with httpx.Client(base_url=steady_daemon.url) as client:
        answers = [
            (body, fits, client.post("/api/v1/sequence/validate", json=least | body).status_code)
            for body, fits in tried
        ]

    assert len([body for body, _ in tried if "sub_phases" in body]) >= 7
    assert {"base_frequency_hz", "exposure_s", "takes", "harmonics"} <= {
        name for body, _ in tried for name in body
    }
    highest = {"harmonics": 32}  # of all cameras; this one's frequencies allow for fewer at 23 MHz
    wrong = [each for each in answers if each[2] != (200 if each[1] else 422)]
    assert [each for each in wrong if each[0] != highest] == []


def test_the_pixels_that_are_stated_are_those_of_the_camera(
    document: dict[str, Any], steady_daemon: Served
) -> None:
    parameters = document["paths"]["/api/v1/frames/{frame}/pixel"]["get"]["parameters"]
    most = {each["name"]: each["schema"].get("maximum") for each in parameters}

    with httpx.Client(base_url=f"{steady_daemon.url}/api/v1/frames/latest/") as client:
        last = {"x": most["x"], "y": most["y"]}
        inside = client.get("pixel", params=last | {"wait_s": 10})
        beyond = [client.get("pixel", params=last | {name: last[name] + 1}) for name in last]

    assert inside.status_code == 200
    assert [each.status_code for each in beyond] == [422, 422]
