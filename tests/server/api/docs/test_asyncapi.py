"""The stream's description, against the messages that really travel."""

import json
from collections.abc import Iterator
from typing import Any

import httpx
import jsonschema  # type: ignore[import-untyped]  # its stubs are another package
import pytest
from pydantic_asyncapi import AsyncAPI

from tests.server.streaming import streaming
from tests.serving import Served
from transientcam import wire
from transientcam_server.api._docs.asyncapi import asyncapi

DOCUMENT = asyncapi(version="1.2.3", host="camera.lab:8000", secure=False)


def references(value: Any) -> Iterator[str]:
    """Every ``$ref`` within."""
    match value:
        case {"$ref": str(reference)}:
            yield reference
        case dict():
            for each in value.values():
                yield from references(each)
        case list():
            for each in value:
                yield from references(each)


def resolve(reference: str) -> Any:
    """What a reference points at; a KeyError where it points at nothing."""
    found: Any = DOCUMENT
    for part in reference.removeprefix("#/").split("/"):
        found = found[part]
    return found


def check(name: str, document: dict[str, Any]) -> None:
    """Hold a message to the schema of its kind."""
    schema = {"$ref": f"#/components/schemas/{name}", "components": DOCUMENT["components"]}
    jsonschema.Draft202012Validator(schema).validate(document)


def unpacked(data: str | bytes) -> dict[str, Any]:
    """A message as JSON Schema sees it: binary as text."""
    document = wire.unpack(data, max_bytes=2**26)
    seen: dict[str, Any] = json.loads(json.dumps(document, default=lambda value: value.hex()))
    return seen


def test_it_is_an_asyncapi_document_whose_references_lead_somewhere() -> None:
    AsyncAPI.model_validate(DOCUMENT)
    for reference in references(DOCUMENT):
        assert resolve(reference)
    for schema in DOCUMENT["components"]["schemas"].values():
        jsonschema.Draft202012Validator.check_schema(schema)


def test_it_is_served_linked_and_says_where_it_was_found(steady: httpx.Client) -> None:
    response = steady.get("/asyncapi.json")
    info = steady.get("/api/v1/info").json()

    assert response.headers["content-type"] == "application/json"
    assert response.json()["servers"]["here"]["host"] == steady.base_url.netloc.decode()
    assert info["stream"]["asyncapi"] == "/asyncapi.json"
    assert "(asyncapi.json)" in steady.get("/openapi.json").json()["info"]["description"]


def test_what_the_daemon_sends_is_as_described(served: Served) -> None:
    everything = [
        {"product": product.name, "encoding": encoding, "decimation": 3}
        for product in wire.PRODUCTS.values()
        if "time" not in product.axes
        for encoding in product.encodings
    ]
    # as many as a client may have, those with an encoding of their own among them
    chosen = sorted(everything, key=lambda each: each["encoding"] == "f32")[
        : wire.MAX_SUBSCRIPTIONS
    ]
    missing = {(each["product"], each["encoding"]) for each in chosen}
    with streaming(served.stream_url) as client:
        client.send({"type": "subscribe", "v": 1, "subscriptions": chosen})
        while missing:  # some take long, and quick ones come again and again meanwhile
            message = unpacked(client.connection.recv(timeout=60.0))
            check(message["type"], message)
            missing.discard((message.get("product"), message.get("encoding", "f32")))
        client.send({"type": "dance"})
        while (message := unpacked(client.connection.recv(timeout=60.0)))["type"] != "error":
            pass
        check("error", message)


def test_what_clients_send_is_as_described() -> None:
    subscription = wire.Subscription("range", 5.0, "u16", (1, 2, 3, 4), 2)
    for message in (
        wire.Subscribe((wire.Subscription("flags"),)),
        wire.Subscribe((subscription,), token="t", credits=2, start=7),
    ):
        check("subscribe", message.to_document())
    check("ack", wire.Ack(3).to_document())


@pytest.mark.parametrize(
    "wrong",
    [
        {"v": 2},
        {"subscriptions": []},
        {"subscriptions": [{"product": "magic"}]},
        {"subscriptions": [{"product": "range", "encoding": "f16"}]},
        {"subscriptions": [{"product": "range", "region": [1, 2, 3]}]},
        {"subscriptions": [{"product": "range", "decimation": 65}]},
        {"credits": 65},
        {"start": 0},
    ],
)
def test_what_the_daemon_would_refuse_is_not_as_described(wrong: dict[str, Any]) -> None:
    document = wire.Subscribe((wire.Subscription("range"),)).to_document() | wrong

    with pytest.raises(jsonschema.ValidationError):
        check("subscribe", document)


@pytest.mark.parametrize("kind", sorted(wire.NOTICES))
def test_a_notice_of_each_kind_is_described_with_its_keys(kind: str) -> None:
    values: dict[str, Any] = {"integer": 1, "string": "x", "object": {}, "array": []}
    values |= {"null": None, "boolean": True, "number": 0.5}
    described = wire.NOTICES[kind]
    details = {
        key: values[types if isinstance(types, str) else types[0]]
        for key, types in described.keys.items()
    }
    check("notice", wire.Notice(kind, details).to_document())

    for missing in set(details) - set(described.optional):
        fewer = {key: value for key, value in details.items() if key != missing}
        with pytest.raises(jsonschema.ValidationError):
            check("notice", wire.Notice(kind, fewer).to_document())
