"""Every answer against the OpenAPI document: path, status, media type and JSON body."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import httpx
import jsonschema  # type: ignore[import-untyped]  # its stubs are another package
from fastapi import FastAPI

from tests.serving import Served
from transientcam_driver import Capabilities

_API = re.compile(r"^/(api|livez|readyz|metrics)")
_documents: dict[Capabilities, dict[str, Any]] = {}


def _hold_to_contract(client: httpx.Client, app: FastAPI) -> None:
    """Check every answer that ``client`` gets from ``app`` from now on."""
    # making the document takes half a second, and it depends on nothing but the camera
    capabilities = app.state.service.camera.capabilities
    if capabilities not in _documents:
        _documents[capabilities] = app.openapi()
    document = _documents[capabilities]

    def check(response: httpx.Response) -> None:
        response.read()
        check_answer(document, response)

    client.event_hooks["response"].append(check)


@contextmanager
def client_of(served: Served, path: str = "") -> Iterator[httpx.Client]:
    """Give a client of a daemon, below a path, every answer of which is held to the contract.

    It waits longer than any answer takes on a laden machine.
    """
    with httpx.Client(base_url=served.url + path, timeout=300.0) as client:
        _hold_to_contract(client, served.app)
        yield client


def check_answer(document: dict[str, Any], response: httpx.Response) -> None:
    """Check one answer; paths outside the interface and unknown ones need only be problems."""
    path = response.request.url.path
    head = response.request.method == "HEAD"  # answers as GET does, without the body
    operation = find_operation(document, path, "GET" if head else response.request.method)
    status = response.status_code
    media_type = response.headers.get("content-type", "").partition(";")[0]
    if status >= 400:
        assert media_type == "application/problem+json", f"{status} of {path} is {media_type}"
    if status >= 400 and not head:
        body = response.json()
        assert body["status"] == status
        assert body["type"].startswith("/problems/")
        assert body["title"]
        assert body["detail"]
    if operation is None:
        assert status in (400, 401, 403, 404, 405, 413) or not _API.match(path), path
        return
    if status in (403, 413):  # of the whole service, not of one route
        return
    responses = operation["responses"]
    assert str(status) in responses, f"{status} of {path} is not documented"
    if status == 304:  # never has a body
        return
    content = responses[str(status)].get("content", {})
    assert media_type in content, f"{media_type} of {path} is not documented"
    schema = content[media_type].get("schema")
    if schema is not None and not head and media_type.endswith("json"):
        validate(document, schema, response.json())


def find_operation(document: dict[str, Any], path: str, method: str) -> dict[str, Any] | None:
    """Return the operation that answers a path; fixed paths before those with parameters."""
    paths = sorted(document["paths"], key=lambda template: template.count("{"))
    for template in paths:
        # the numbers of a chunk have slashes between them
        pattern = re.escape(template).replace(r"\{chunk\}", ".+")
        pattern = re.sub(r"\\\{\w+\\\}", "[^/]+", pattern)
        if re.fullmatch(pattern, path):
            operation: dict[str, Any] | None = document["paths"][template].get(method.lower())
            return operation
    return None


def validate(document: dict[str, Any], schema: dict[str, Any], value: Any) -> None:
    """Validate a JSON value against a schema of the document (OpenAPI 3.1: JSON Schema)."""
    whole = {"$defs": {}, "components": document.get("components", {}), **schema}
    jsonschema.Draft202012Validator(whole).validate(value)
