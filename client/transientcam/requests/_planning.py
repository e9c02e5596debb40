"""Requests about accuracy and time: a sequence for a goal, and what accuracy costs."""

from collections.abc import Mapping
from typing import Any, Final

from transientcam.requests._request import Request, document

_PLANNED_S: Final = 120.0
"""How much longer than usual it takes to look at a scene and weigh all sequences, when busy."""


def plan(**parts: Mapping[str, Any] | str | None) -> Request[dict[str, Any]]:
    """Build the request for a plan; parts that are None are left to the server."""
    return document("plan", method="POST", body=_body(parts), extra_timeout_s=_PLANNED_S)


def start_plan(**parts: Mapping[str, Any] | str | None) -> Request[dict[str, Any]]:
    """Build the request for the job that makes a plan; parts as in `plan`."""
    return document("plan/jobs", method="POST", body=_body(parts))


def _body(parts: Mapping[str, Mapping[str, Any] | str | None]) -> dict[str, Any]:
    return {
        name: dict(part) if isinstance(part, Mapping) else part
        for name, part in parts.items()
        if part is not None
    }


def tradeoff(by: str) -> Request[dict[str, Any]]:
    """Build the request for all sequences that no other beats."""
    return document("tradeoff", params=[("by", by)], extra_timeout_s=_PLANNED_S)


def start_tradeoff(by: str) -> Request[dict[str, Any]]:
    """Build the request for the job that finds these."""
    return document("tradeoff/jobs", method="POST", body={"by": by})
