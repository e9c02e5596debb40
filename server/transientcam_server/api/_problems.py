"""Errors as RFC 9457 problem documents, and the one place where foreign errors become problems."""

import re
from collections.abc import Callable, Iterable
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, Response
from starlette.exceptions import HTTPException
from starlette.routing import Match

from transientcam.wire import PROBLEM_MEDIA_TYPE
from transientcam_driver import DriverError
from transientcam_moments import ParameterError
from transientcam_server.api._docs.openapi import Interface
from transientcam_server.errors import (
    Problem,
    ProblemDocument,
    ProblemKind,
    kinds,
    plain,
    problem_document,
    problem_of,
    shortened,
)
from transientcam_server.logs import request_id

_KIND_OF_STATUS = {
    kind.status: kind
    for kind in (kinds.BAD_REQUEST, kinds.NOT_FOUND, kinds.METHOD_NOT_ALLOWED, kinds.TOO_LARGE)
}


def problem_response(problem: Problem, *, instance: str | None = None) -> Response:
    """Return a problem as an HTTP answer."""
    document = problem_document(problem, instance=instance)
    identifier = request_id.get()
    headers = {"Cache-Control": "no-store"}
    if "retry_after_s" in problem.extensions:
        headers["Retry-After"] = str(problem.extensions["retry_after_s"])
    return JSONResponse(
        document if identifier is None else document | {"request_id": identifier},
        status_code=problem.kind.status,
        media_type=PROBLEM_MEDIA_TYPE,
        headers=headers,
    )


_REFERENCE = {"$ref": "#/components/schemas/ProblemDocument"}


def documented(*problem_kinds: ProblemKind) -> dict[int | str, dict[str, Any]]:
    """Return what a route's OpenAPI entry states of the problems it may answer with."""
    responses: dict[int | str, dict[str, Any]] = {}
    _add_to(responses, problem_kinds, key=int)
    return responses


def document_problems(operation: dict[str, Any], *problem_kinds: ProblemKind) -> None:
    """Add problems to an operation of an OpenAPI document that exists already."""
    _add_to(operation["responses"], problem_kinds, key=str)


def _add_to(
    responses: dict[Any, dict[str, Any]],
    problem_kinds: Iterable[ProblemKind],
    *,
    key: Callable[[int], int | str],
) -> None:
    for kind in problem_kinds:
        entry = responses.setdefault(
            key(kind.status),
            {
                "description": "",
                "content": {PROBLEM_MEDIA_TYPE: {"schema": _REFERENCE, "examples": {}}},
            },
        )
        examples = entry["content"][PROBLEM_MEDIA_TYPE]["examples"]
        if kind.slug in examples:
            continue
        entry["description"] = "; ".join(filter(None, (entry["description"], kind.title)))
        examples[kind.slug] = {
            "summary": kind.title,
            "value": problem_document(Problem(kind, kind.meaning)),
        }


def describe(app: FastAPI, *, prefix: str) -> None:
    """Add to the OpenAPI document of ``app`` what `documented` refers to.

    Reads below ``prefix`` refuse parameters that they do not have.

    A model named in a route's responses would be documented as plain JSON beside the problem.
    """
    generate = app.openapi

    def openapi() -> dict[str, Any]:
        document = generate()
        schema = ProblemDocument.model_json_schema()
        document.setdefault("components", {}).setdefault("schemas", {})["ProblemDocument"] = schema
        for path, operations in document["paths"].items():
            for method, operation in operations.items():
                responses, body = operation["responses"], "requestBody" in operation
                if "400" not in responses and (body or "{" in path):
                    document_problems(operation, kinds.BAD_REQUEST)  # no JSON, or no HTTP
                if "application/json" in responses.get("422", {}).get("content", ()):
                    del responses["422"]  # the framework's own statement of what follows
                if (
                    body
                    or "parameters" in operation
                    or (method == "get" and path.startswith(prefix))
                ):
                    document_problems(operation, kinds.INVALID_REQUEST)
        for name in ("HTTPValidationError", "ValidationError"):
            document["components"]["schemas"].pop(name, None)
        return document

    app.openapi = openapi  # type: ignore[method-assign]  # as FastAPI's documentation extends it


def install(app: FastAPI, *, prefix: str) -> None:
    """Answer every error of ``app`` as a problem, and document it as one."""
    describe(app, prefix=prefix)
    app.state.interface = Interface(app)

    async def known(request: Request, error: Exception) -> Response:
        return problem_response(problem_of(error), instance=request.url.path)

    async def invalid(request: Request, error: Exception) -> Response:
        assert isinstance(error, RequestValidationError)  # noqa: S101 - registered for it below
        return problem_response(_of_validation(error), instance=request.url.path)

    async def http(request: Request, error: Exception) -> Response:
        assert isinstance(error, HTTPException)  # noqa: S101 - registered for it below
        response = problem_response(_of_http(error, request), instance=request.url.path)
        response.headers.update(error.headers or {})
        if error.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
            response.headers["Allow"] = await _allowed(request) or response.headers.get("Allow", "")
        return response

    for kind in (Problem, DriverError, ParameterError):
        app.add_exception_handler(kind, known)
    app.add_exception_handler(RequestValidationError, invalid)
    app.add_exception_handler(HTTPException, http)


def _of_http(error: HTTPException, request: Request) -> Problem:
    kind = _KIND_OF_STATUS.get(error.status_code)
    if kind is None:
        status = HTTPStatus(error.status_code)
        slug = status.phrase.lower().replace(" ", "-")
        kind = ProblemKind(status, status.phrase, "", slug)
    if kind is kinds.NOT_FOUND:
        return Problem(kind, f"Nothing is at {shortened(request.url.path)}.")
    if kind is kinds.METHOD_NOT_ALLOWED:
        detail = f"{shortened(request.url.path)} does not answer {request.method}."
        return Problem(kind, detail)
    return Problem(kind, str(error.detail))


async def _allowed(request: Request) -> str:
    """Return every method of a path; the framework names only those of the first route.

    A path that the OpenAPI document names as it is has the methods that stand there, also where
    a pattern fits it: `/calibrations/active` is no id.
    """
    app: FastAPI = request.app
    document = await app.state.interface.document()
    documented_there = document["paths"].get(request.url.path)

    def answered(method: str) -> bool:
        scope = {**request.scope, "method": method}
        return any(route.matches(scope)[0] is Match.FULL for route in app.routes)

    methods = {method for method in ("DELETE", "GET", "PATCH", "POST", "PUT") if answered(method)}
    if documented_there is not None:
        methods &= {name.upper() for name in documented_there}
    return ", ".join(sorted(methods | ({"HEAD"} if "GET" in methods else set())))


def _of_validation(error: RequestValidationError) -> Problem:
    mistakes = [_mistake(each) for each in error.errors()]
    first = mistakes[0]
    detail = f"{first['field']} is {_shown(first['value'])}, but must be {first['limit']}"
    more = {"errors": mistakes} if len(mistakes) > 1 else {}
    return Problem(kinds.INVALID_REQUEST, detail, **first, **more)


def _mistake(each: dict[str, Any]) -> dict[str, Any]:
    if each["type"] == "json_invalid":  # its place is that of a character
        return {"field": "body", "value": None, "limit": _limit(each)}
    # the first part of the location is only body, query or path
    parts = [str(part) for part in each["loc"][1:]] or [str(each["loc"][0])]
    value = None if each["type"] == "missing" else plain(each.get("input"))
    return {"field": ".".join(parts), "value": value, "limit": _limit(each)}


def _limit(each: dict[str, Any]) -> str:
    """Return what a value must be, in pydantic's words; they are to follow "must be"."""
    message = str(each.get("msg", ""))
    match each["type"]:
        case "missing":
            return "given"
        case "extra_forbidden":
            return "left out"
        case "model_attributes_type":
            return "a JSON object"
        case "json_invalid":
            return f"valid JSON ({(each.get('ctx') or {}).get('error', '')})"
        case "value_error":
            return message.removeprefix("Value error, ").removeprefix("must be ")
    limit = re.sub(r"^Input should be |^\w+ should have ", "", message)
    return limit.replace("greater than or equal to", "at least").replace(
        "less than or equal to", "at most"
    )


def _shown(value: object) -> str:
    return "missing" if value is None else shortened(repr(value))
