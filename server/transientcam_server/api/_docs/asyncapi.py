"""The stream as an AsyncAPI document, made of the wire contract: what OpenAPI cannot describe."""

from typing import Any, Final

from pydantic import TypeAdapter

from transientcam import wire
from transientcam_server.api._documents.document import EXAMPLES
from transientcam_server.api._documents.frame import FrameDocument
from transientcam_server.errors import ProblemDocument
from transientcam_server.imaging import product_names

PATH: Final = "/asyncapi.json"
_SCHEMAS: Final = "#/components/schemas/"
_Schema = dict[str, Any]

_SUMMARIES: Final = {
    "subscribe": "what a client receives from now on; its first message, within "
    f"{wire.FIRST_MESSAGE_WITHIN_S:g} s; answered with hello or error",
    "ack": "the client is done with a frame and all before it",
    "hello": "the answer to a subscription",
    "frame": "one product of one frame",
    "notice": "an event that clients are notified of",
    "error": "a message could not be used, or a product not be computed",
}
_OF_CLIENT: Final = ("subscribe", "ack")


def asyncapi(*, version: str, host: str, secure: bool, root_path: str = "") -> dict[str, Any]:
    """Return the document for a service that is reached as ``host``, below ``root_path``.

    It is seen from the service, as AsyncAPI has it: it receives what clients send.
    """
    return {
        "asyncapi": "3.0.0",
        "info": {
            "title": "transientcam stream",
            "version": version,
            "description": "Frames as they are captured. Every message is one binary WebSocket "
            "message holding one msgpack map; docs/stream.md describes them in words.",
        },
        "defaultContentType": wire.MEDIA_TYPE,
        "servers": {
            "here": {"host": host, "pathname": root_path, "protocol": "wss" if secure else "ws"}
        },
        "channels": {
            "stream": {
                "address": "/api/v1/stream",
                "title": "Stream",
                "description": _closing(),
                "messages": {name: _reference("messages", name) for name in _SUMMARIES},
                "bindings": {
                    "ws": {
                        "method": "GET",
                        "query": {"type": "object"},
                        "headers": _map(
                            {
                                "Sec-WebSocket-Protocol": {
                                    "type": "string",
                                    "const": wire.SUBPROTOCOL,
                                }
                            }
                        ),
                        "bindingVersion": "0.1.0",
                    }
                },
            }
        },
        "operations": {f"on-{name}": _operation(name) for name in _SUMMARIES},
        "components": {
            "messages": {name: _message(name) for name in _SUMMARIES},
            "schemas": _schemas(),
        },
    }


def _closing() -> str:
    codes = ", ".join(f"{each} {each.name.lower().replace('_', ' ')}" for each in wire.CloseCode)
    return f"One connection of one client. It ends with one of the codes {codes}."


def _operation(name: str) -> dict[str, Any]:
    stream = {"$ref": "#/channels/stream"}
    return {
        "action": "receive" if name in _OF_CLIENT else "send",
        "channel": stream,
        "summary": _SUMMARIES[name],
        "messages": [{"$ref": f"#/channels/stream/messages/{name}"}],
    }


def _message(name: str) -> dict[str, Any]:
    return {
        "name": name,
        "title": name.capitalize(),
        "summary": _SUMMARIES[name],
        "contentType": wire.MEDIA_TYPE,
        "payload": _reference("schemas", name),
    }


def _schemas() -> dict[str, _Schema]:
    version = {"type": "integer", "const": wire.VERSION}
    schemas: dict[str, _Schema] = {
        "subscribe": _map(
            {
                "type": _constant("subscribe"),
                "v": version,
                "token": _or_nil({"type": "string", "maxLength": 4096}),
                "subscriptions": {
                    "type": "array",
                    "items": _reference("schemas", "subscription"),
                    "minItems": 1,
                    "maxItems": wire.MAX_SUBSCRIPTIONS,
                },
                "credits": _or_nil(_integer(1, wire.MAX_CREDITS)),
                "start": _or_nil(_integer(1)),
            },
            required=("type", "v", "subscriptions"),
        ),
        "subscription": _map(
            {
                "product": {"type": "string", "enum": sorted(product_names())},
                "max_rate_hz": _or_nil({"type": "number", "exclusiveMinimum": 0}),
                "encoding": _or_nil({"type": "string", "enum": list(wire.encoding_names())}),
                "region": _or_nil(_REGION),
                "decimation": _or_nil(_integer(1, wire.MAX_DECIMATION)),
            },
            required=("product",),
        ),
        "ack": _map({"type": _constant("ack"), "frame": _integer(0)}),
        "hello": _map(
            {
                "type": _constant("hello"),
                "v": version,
                "session": {"type": "string"},
                "server": _map({"name": {"type": "string"}, "version": {"type": "string"}}),
                "channels": {"type": "array", "items": _reference("schemas", "channel")},
                "sequence": {"type": "object", "description": "as GET /api/v1/sequence answers"},
                "camera": _map({"state": {"type": "string"}}),
            }
        ),
        "channel": _of_type(wire.Channel),
        "frame": _frame(),
        "array": _map(
            {
                "dtype": {"type": "string", "enum": sorted(wire.DTYPES)},
                "shape": {"type": "array", "items": _integer(0)},
                "data": {"type": "string", "format": "binary", "description": "C order"},
            }
        ),
        "notice": {"oneOf": [_notice(kind) for kind in wire.NOTICES.values()]},
        "error": _map({"type": _constant("error"), "problem": _reference("schemas", "problem")}),
        "problem": _of_type(ProblemDocument),
    }
    meta = TypeAdapter(FrameDocument).json_schema(ref_template=_SCHEMAS + "{model}")
    meta["properties"] |= {"region": _REGION, "decimation": _integer(1, wire.MAX_DECIMATION)}
    meta["required"] = sorted(meta["properties"])
    meta["examples"] = [EXAMPLES["FrameDocument"]]
    schemas |= meta.pop("$defs", {})
    return schemas | {"meta": meta}


_REGION: Final[_Schema] = {
    "type": "array",
    "items": {"type": "integer", "minimum": 0},
    "minItems": 4,
    "maxItems": 4,
    "description": "column and row of the first pixel, width, height",
}


def _frame() -> _Schema:
    return _map(
        {
            "v": {"type": "integer", "const": wire.VERSION},
            "type": _constant("frame"),
            "channel": _integer(0),
            "product": {"type": "string", "enum": sorted(product_names())},
            "unit": {"type": "string"},
            "axes": {"type": "array", "items": {"type": "string"}},
            "meta": _reference("schemas", "meta"),
            "encode_s": {"type": "number"},
            "labels": {"type": "array", "items": {"type": "object"}, "description": "raw alone"},
            "multiples": {
                "type": "array",
                "items": {"type": "integer"},
                "description": "moments alone",
            },
            "frequencies_hz": {
                "type": "array",
                "items": {"type": "number"},
                "description": "moments alone",
            },
            "encoding": {"type": "string", "enum": list(wire.ENCODINGS)},
            **_encoding_fields(),
            "approximate": {"type": "boolean"},
            "max_error": {"type": "number", "description": "of the density, over its peak"},
            "median_error": {"type": "number"},
            "pad": {"type": "string", "format": "binary"},
            "array": _reference("schemas", "array"),
        },
        required=(
            *("v", "type", "channel", "product", "unit", "axes", "meta", "encode_s"),
            *("pad", "array"),
        ),
    )


def _encoding_fields() -> dict[str, _Schema]:
    """Return the fields that only messages in some encoding have."""
    return {
        name: {**schema, "description": f"{encoding.name} alone"}
        for encoding in wire.ENCODINGS.values()
        for name, schema in encoding.fields.items()
    }


def _notice(kind: wire.NoticeKind) -> _Schema:
    keys = {name: {"type": types} for name, types in kind.keys.items()}
    required = [name for name in keys if name not in kind.optional]
    schema = _map(
        {"type": _constant("notice"), "kind": _constant(kind.name), **keys},
        required=("type", "kind", *required),
    )
    return {"title": kind.name, "description": kind.summary, **schema}


def _of_type(described: type) -> _Schema:
    return TypeAdapter(described).json_schema()


def _map(properties: dict[str, _Schema], *, required: tuple[str, ...] | None = None) -> _Schema:
    names = list(properties) if required is None else list(required)
    return {"type": "object", "properties": properties, "required": names}


def _constant(value: str) -> _Schema:
    return {"type": "string", "const": value}


def _integer(minimum: int, maximum: int | None = None) -> _Schema:
    schema: _Schema = {"type": "integer", "minimum": minimum}
    return schema if maximum is None else schema | {"maximum": maximum}


def _or_nil(schema: _Schema) -> _Schema:
    return {"oneOf": [schema, {"type": "null"}]}


def _reference(kind: str, name: str) -> dict[str, str]:
    return {"$ref": f"#/components/{kind}/{name}"}
