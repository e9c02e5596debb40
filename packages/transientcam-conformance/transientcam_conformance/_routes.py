"""Every route of the interface: it is there, and answers as the OpenAPI document describes."""

import re
from collections.abc import Iterator, Mapping
from typing import Any, Final

import httpx

from transientcam.requests import problem
from transientcam.transport import answer_of, media_type
from transientcam_conformance._device import API, Device
from transientcam_conformance._expecting import expect, skip_unless

_OF_THE_SERVICE: Final = frozenset(("403", "408", "413", "429", "431"))
"""Any request may be refused with these, whatever its route."""
_READ_TIMEOUTS: Final = 6.0
ROUTES: Final = (
    "GET /info",
    "GET /camera",
    "GET /parameters",
    "GET /sequence",
    "PUT /sequence",
    "POST /sequence/validate",
    "GET /reconstruction",
    "PUT /reconstruction",
    "GET /acquisition",
    "PUT /acquisition",
    "POST /acquisition/safe-off",
    "GET /frames",
    "GET /frames/{frame}",
    "GET /frames/{frame}/pixel",
    "GET /frames/{frame}/{product}",
    "GET /lease",
    "POST /lease",
    "PUT /lease",
    "DELETE /lease",
    "GET /calibrations",
    "POST /calibrations",
    "POST /calibrations/import",
    "GET /calibrations/active",
    "PUT /calibrations/active",
    "GET /calibrations/{calibration}",
    "DELETE /calibrations/{calibration}",
    "GET /calibrations/{calibration}/file",
    "GET /jobs",
    "GET /jobs/{job}",
    "POST /jobs/{job}/cancel",
    "GET /recordings",
    "POST /recordings",
    "GET /recordings/{recording}",
    "PATCH /recordings/{recording}",
    "DELETE /recordings/{recording}",
    "POST /recordings/{recording}/stop",
    "GET /recordings/{recording}/file",
    "GET /recordings/{recording}/frames",
    "GET /recordings/{recording}/frames/{frame}",
    "GET /recordings/{recording}/frames/{frame}/{product}",
)


def every_route_of_the_contract_is_described(device: Device) -> None:
    """The OpenAPI document describes every route that clients rely on."""
    missing = [each for each in ROUTES if not device.offers(*each.split(" "))]
    expect(not missing, f"not described: {', '.join(missing)}")


def versions_are_stated(device: Device) -> None:
    """The unversioned /api/versions names the versions of the interface and where they are."""
    versions = device.read("/api/versions")
    paths = {each["name"]: each["path"] for each in versions.get("api", [])}
    expect(paths.get("v1") == API, f"/api/versions names {paths}, without v1 at {API}")
    expect(device.read(f"{API}/info").get("api") == "v1", "/info names another version")


def every_route_answers_as_documented(device: Device) -> None:
    """Reading any route gives a status and a media type that its description has."""
    for operation, response in _answers(device):
        _check_documented(operation, response)


def every_document_fits_its_schema(device: Device) -> None:
    """Every JSON document that a route answers with fits the schema that describes it."""
    try:
        import jsonschema  # type: ignore[import-untyped]  # its stubs are another package
    except ModuleNotFoundError:
        skip_unless(False, "jsonschema is not installed: pip install 'transientcam[conformance]'")
        return
    for operation, response in _answers(device):
        schema = _schema(operation, response)
        if schema is None:
            continue
        whole = {"components": device.openapi.get("components", {}), **schema}
        try:
            jsonschema.Draft202012Validator(whole).validate(response.json())
        except jsonschema.ValidationError as error:
            expect(False, f"{_name(response)}: {error.json_path}: {error.message[:200]}")


def head_is_get_without_its_body(device: Device) -> None:
    """HEAD is answered as GET is, without the body."""
    for path in (f"{API}/info", "/livez"):
        head = device.send("HEAD", path)
        expect(head.status_code == httpx.codes.OK, f"HEAD {path} gives {head.status_code}")
        expect(not head.content, f"HEAD {path} is answered with a body")


def a_body_that_is_no_json_is_refused(device: Device) -> None:
    """A body that cannot be read is refused with a documented problem, whatever the route."""
    headers = {"content-type": "application/json"}
    for path, method, operation in _operations(device):
        body = operation.get("requestBody", {})
        if "application/json" not in body.get("content", {}):
            continue
        concrete = _concrete(path, operation)
        response = device.send(method, concrete, content=b'{"a": ', headers=headers)
        expect(400 <= response.status_code < 500, f"{_name(response)} takes what is no JSON")
        _check_documented(operation, response)
        device.refusal(response, response.status_code)


def _operations(device: Device) -> Iterator[tuple[str, str, dict[str, Any]]]:
    for path, methods in sorted(device.openapi["paths"].items()):
        for method, operation in methods.items():
            if method in ("get", "put", "post", "patch", "delete"):
                yield path, method.upper(), operation


def _answers(device: Device) -> Iterator[tuple[dict[str, Any], httpx.Response]]:
    """Read every route there is, once, each with the example that its description gives.

    Each is read when it is asked for: what one is found wrong by need not wait for those after it.
    """
    reads = [(path, told) for path, method, told in _operations(device) if method == "GET"]
    for at, (path, operation) in enumerate(reads):
        if at == len(device.answers):
            query = {
                each["name"]: _example(each)
                for each in operation.get("parameters", ())
                if each["in"] == "query" and each.get("required")
            }
            # some compute for long, and more so on a machine that is busy
            timeout_s = _READ_TIMEOUTS * device.timeout_s
            response = device.peek(_concrete(path, operation), params=query, timeout=timeout_s)
            device.answers.append((operation, response))
        yield device.answers[at]


def _concrete(path: str, operation: Mapping[str, Any]) -> str:
    examples = {
        each["name"]: str(_example(each))
        for each in operation.get("parameters", ())
        if each["in"] == "path"
    }
    return re.sub(r"\{(\w+)\}", lambda found: examples.get(found[1], "1"), path)


def _example(parameter: Mapping[str, Any]) -> Any:
    schema = parameter.get("schema", {})
    return next(iter(schema.get("examples", ())), schema.get("default", 1))


def _check_documented(operation: Mapping[str, Any], response: httpx.Response) -> None:
    status = str(response.status_code)
    if status in _OF_THE_SERVICE:
        return
    reason = "" if response.is_success else f" ({problem(answer_of(response))})"
    known = operation["responses"]
    expect(
        status in known, f"{_name(response)} gives {status}{reason}, not one of {', '.join(known)}"
    )
    content = known[status].get("content", {})
    found = _type(response)
    expect(not content or found in content, f"{_name(response)} gives {found} with status {status}")


def _schema(operation: Mapping[str, Any], response: httpx.Response) -> dict[str, Any] | None:
    content = operation["responses"].get(str(response.status_code), {}).get("content", {})
    if not _type(response).endswith("json"):
        return None
    schema: dict[str, Any] | None = content.get(_type(response), {}).get("schema")
    return schema


def _type(response: httpx.Response) -> str:
    return media_type(response.headers.get("content-type", ""))


def _name(response: httpx.Response) -> str:
    return f"{response.request.method} {response.request.url.path}"
