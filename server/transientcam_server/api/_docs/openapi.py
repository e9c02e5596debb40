"""The OpenAPI document: what this camera accepts, made once and not on the event loop."""

import asyncio
import copy
import json
from typing import Any, Final

from fastapi import APIRouter, FastAPI, Request, Response

from transientcam_driver import Capabilities
from transientcam_driver.sequence import READ_ONLY_FIELDS
from transientcam_server.api._documents.document import EXAMPLES

PATH: Final = "/openapi.json"
router = APIRouter(include_in_schema=False)


class Interface:
    """Makes the document when it is first asked for: half a second of computing."""

    def __init__(self, app: FastAPI) -> None:
        self._app = app
        self._made: asyncio.Task[tuple[dict[str, Any], bytes]] | None = None

    async def document(self) -> dict[str, Any]:
        """Return the document."""
        return (await self._make())[0]

    async def content(self) -> bytes:
        """Return the document as JSON."""
        return (await self._make())[1]

    async def _make(self) -> tuple[dict[str, Any], bytes]:
        if self._made is None:
            self._made = asyncio.create_task(asyncio.to_thread(_made, self._app))
        return await asyncio.shield(self._made)


def _made(app: FastAPI) -> tuple[dict[str, Any], bytes]:
    document = app.openapi()
    return document, json.dumps(document, separators=(",", ":")).encode()


@router.get(PATH)
async def interface(request: Request) -> Response:
    """Describe the interface."""
    made: Interface = request.app.state.interface
    return Response(await made.content(), media_type="application/json")


def describe_limits(app: FastAPI, camera: Capabilities, *, prefix: str) -> None:
    """Add to the OpenAPI document of ``app`` examples, and what one camera can do, field by field.

    What depends on several fields, as the highest frequency, it does not state.
    """
    generate = app.openapi

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            made = generate()
            for name, example in EXAMPLES.items():  # FastAPI would leave out what is null
                made["components"]["schemas"][name]["examples"] = [example]
            paths = made["paths"]
            for path, method in (("/sequence", "put"), ("/sequence/validate", "post")):
                body = paths[prefix + path][method]["requestBody"]["content"]["application/json"]
                body["schema"] = _limited(body["schema"], camera)
            for path in ("pixel", "pixel.csv", "{product}"):
                _limit_pixels(paths[f"{prefix}/frames/{{frame}}/{path}"]["get"], camera)
        return generate()

    app.openapi = openapi  # type: ignore[method-assign]  # as FastAPI's documentation extends it


def _limited(sequence: dict[str, Any], camera: Capabilities) -> dict[str, Any]:
    """Return the schema of a sequence with the limits of a camera."""
    schema = copy.deepcopy(sequence)  # other applications have other cameras
    schema["examples"] = [EXAMPLES["SequenceDocument"]]
    properties = schema["properties"]
    least_hz, most_hz = camera.min_frequency_hz, camera.max_frequency_hz
    stated: dict[str, dict[str, Any]] = {
        "base_frequency_hz": {"minimum": least_hz, "maximum": most_hz},
        "harmonics": {"maximum": camera.max_harmonics},
        "zeroth": {"enum": list(camera.zeroths)},
        "exposure_s": {"minimum": camera.min_exposure_s, "maximum": camera.max_exposure_s},
        "takes": {"maximum": camera.max_takes},
        "take_order": {"enum": list(camera.take_orders)},
    }
    for name, limits in stated.items():
        properties[name] |= limits
        if "minimum" in limits:
            properties[name].pop("exclusiveMinimum", None)
    properties["sampling"]["anyOf"][0]["$ref"] = "#/components/schemas/SamplingDocument"
    parts = properties["sub_phases"]
    parts["properties"]["n"]["maximum"] = camera.max_sub_phases
    parts["properties"]["scheme"]["enum"] = list(camera.schemes)
    parts["additionalProperties"] = schema["additionalProperties"] = False
    for name in sorted(READ_ONLY_FIELDS):
        properties[name] = {"readOnly": True, "description": "Ignored: the camera states it."}
    return schema


def _limit_pixels(operation: dict[str, Any], camera: Capabilities) -> None:
    most = {"x": camera.width - 1, "y": camera.height - 1}
    for parameter in operation["parameters"]:
        if parameter["name"] in most:
            schema = parameter["schema"]
            number = schema.get("anyOf", [schema])[0]
            number["maximum"] = most[parameter["name"]]
