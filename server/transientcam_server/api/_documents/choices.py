"""The JSON documents about the cameras that the service could serve."""

from typing import Any

from transientcam_server.api._documents.document import Document, RequestDocument


class CameraChoicesDocument(Document):
    """The camera that is served, and those that could be in its place."""

    current: str
    """Its name, as `camera` of the settings has it; `none` while there is none."""
    cameras: list[dict[str, Any]]
    """Found at this machine and on the network: `spec`, the name that opens it, `kind`, `serial`,
    `product`, `node` where it is, and `problem`, why it cannot be opened."""
    simulated: list[str]
    """Simulations, which are always there."""
    kinds: list[dict[str, Any]]
    """Of cameras that can be opened, one a plug-in: `name`, `usage`, `summary`, `options`."""
    problems: dict[str, str]
    """Why a kind could not look for its cameras."""
    missing: list[dict[str, Any]]
    """What this machine lacks for cameras, as `transientcam doctor` finds it: `level`, `check`,
    `message`, `remedy`."""


class CameraRequest(
    RequestDocument, strict=True, json_schema_extra={"examples": [{"camera": "sim:corner"}]}
):
    """Which camera is to be served."""

    camera: str
    """Its name: one of the choices, or `none`. An admin may give any, with options."""


class CameraChangeDocument(Document):
    """The change of the camera that has begun."""

    camera: str
    """Which one is served next: within a second or two, by a service with another `service_id`."""
