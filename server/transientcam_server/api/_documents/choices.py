"""The JSON documents about the cameras that the service could serve."""

from typing import Any

from transientcam_server.api._documents.document import Document, RequestDocument


class CameraChangeDocument(
    RequestDocument, strict=True, json_schema_extra={"examples": [{"camera": "sim:corner"}]}
):
    """Which camera is to be served next."""

    camera: str
    """Its name, as the setting `camera` has it: one of the choices, or `none`."""


class CameraChoicesDocument(Document):
    """The camera that is served, and those that could be in its place."""

    current: str
    """Its name; `none` while there is none."""
    cameras: list[dict[str, Any]]
    """At this machine and on the network: `spec` opens it, unless there is a `problem`."""
    simulated: list[str]
    """Simulations, which are always there."""
    kinds: list[dict[str, Any]]
    """What can be opened, one a plug-in: `name`, `usage`, `summary`, `options`."""
    problems: dict[str, str]
    """Why a kind could not look for its cameras."""
    missing: list[dict[str, Any]]
    """What this machine lacks, as `transientcam doctor` finds it: `check`, `message`, `remedy`."""
