"""Requests that change what the camera captures and how frames are computed."""

from collections.abc import Mapping
from typing import Any, Final

from transientcam.requests._request import Request, document

_SCENE_BUILT_S: Final = 60.0
"""How much longer than usual it takes to build a simulated scene."""


def set_sequence(settings: Mapping[str, Any]) -> Request[dict[str, Any]]:
    """Build the request that sets a sequence; fields that the server derives are ignored there."""
    return document("sequence", method="PUT", body=settings)


def validate_sequence(settings: Mapping[str, Any]) -> Request[dict[str, Any]]:
    """Build the request for what a sequence would be set to."""
    return document("sequence/validate", method="POST", body=settings)


def set_reconstruction(settings: Mapping[str, Any]) -> Request[dict[str, Any]]:
    """Build the request that changes how frames are computed."""
    return document("reconstruction", method="PUT", body=settings)


def set_running(running: bool, *, offs: int | None = None) -> Request[dict[str, Any]]:
    """Build the request that starts or stops the capture; a start unless ``offs`` has changed."""
    body = {"running": running} | ({} if offs is None else {"offs": offs})
    return document("acquisition", method="PUT", body=body)


def safe_off() -> Request[dict[str, Any]]:
    """Build the request that switches the light off."""
    return document("acquisition/safe-off", method="POST")


def set_simulation(
    scene: str | None,
    definition: str | None,
    effects: Mapping[str, str] | None,
    diffuser: bool | None,
) -> Request[dict[str, Any]]:
    """Build the request that changes the simulated world; None leaves a part as it is."""
    parts: dict[str, object] = {
        "scene": scene,
        "definition": definition,
        "effects": None if effects is None else dict(effects),
        "diffusor": diffuser,
    }
    body = {key: value for key, value in parts.items() if value is not None}
    return document("simulation", method="PUT", body=body, extra_timeout_s=_SCENE_BUILT_S)


def inject_fault(name: str) -> Request[dict[str, Any]]:
    """Build the request that lets a part of the simulation fail."""
    return document("simulation/faults", method="POST", body={"fault": name})
