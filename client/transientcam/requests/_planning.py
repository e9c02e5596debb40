"""Requests about accuracy and time: a sequence for a goal, and what accuracy costs."""

from collections.abc import Mapping
from typing import Any, Final
from urllib.parse import quote

from transientcam.requests._request import Request, document, file

_MAP_TYPES: Final = {"npy": "application/octet-stream", "png": "image/png"}
_PLANNED_S: Final = 120.0
"""How much longer than usual it takes to look at a scene and weigh all sequences, when busy."""


def plan(**parts: Any) -> Request[dict[str, Any]]:
    """Build the request for a plan; parts that are None are left to the server."""
    return document("plan", method="POST", body=_body(parts), extra_timeout_s=_PLANNED_S)


def start_plan(**parts: Any) -> Request[dict[str, Any]]:
    """Build the request for the job that makes a plan; parts as in `plan`."""
    return document("plan/jobs", method="POST", body=_body(parts))


def plan_map(job_id: str, form: str) -> Request[bytes]:
    """Build the request for the predicted error of each pixel, as a file."""
    return file(
        f"jobs/{quote(job_id, safe='')}/map.{quote(form, safe='')}", _MAP_TYPES.get(form, "*/*")
    )


def tradeoff(**parts: Any) -> Request[dict[str, Any]]:
    """Build the request for all sequences that no other beats."""
    return document("tradeoff", params=[*_body(parts).items()], extra_timeout_s=_PLANNED_S)


def start_tradeoff(**parts: Any) -> Request[dict[str, Any]]:
    """Build the request for the job that finds these; parts as in `plan`."""
    return document("tradeoff/jobs", method="POST", body=_body(parts))


def _body(parts: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: dict(part) if isinstance(part, Mapping) else part
        for name, part in parts.items()
        if part is not None
    }
