"""Stores of products that somebody laid beside the recordings: none hurts the list of them."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from transientcam_server.api._documents.recording import ProductStoresDocument
from transientcam_server.recording import ProductStores

GOOD: dict[str, Any] = {
    "zarr_format": 3,
    "node_type": "group",
    "attributes": {
        "format": "transientcam products",
        "products": '["range", 16]',
        "recording_id": "r",
        "title": "t",
        "reconstruction": "{}",
    },
    "consolidated_metadata": {"metadata": {"frame": {"shape": [3]}}},
}


def made(shape: object = (3,), **attributes: object) -> str:
    document = json.loads(json.dumps(GOOD))
    document["attributes"].update(attributes)
    document["consolidated_metadata"]["metadata"]["frame"]["shape"] = shape
    return json.dumps(document)


def lay(directory: Path, name: str, text: str | bytes) -> Path:
    store = directory / f"{name}.zarr"
    store.mkdir()
    (store / "zarr.json").write_bytes(text.encode() if isinstance(text, str) else text)
    return store


DAMAGED: dict[str, str | bytes] = {
    "bins infinite": made(products='["range", Infinity]'),
    "bins no number": made(products='["range", NaN]'),
    "bins out of floats": made(products='["range", 1e999]'),
    "bins of 4000 digits": made(products='["range", 1' + "0" * 4000 + "]"),
    "bins negative": made(products='["range", -1]'),
    "bins true": made(products='["range", true]'),
    "bins a text": made(products='["range", "16"]'),
    "bins broken": made(products='["range", 1.5]'),
    "no bins": made(products="[]"),
    "names are numbers": made(products="[1, 2]"),
    "500 000 names": made(products=json.dumps(["a"] * 500_000 + [1])),
    "products no text": made(products=["range", 16]),
    "frames negative": made(shape=[-5]),
    "frames true": made(shape=[True]),
    "frames none": made(shape=[]),
    "frames beyond 2^31": made(shape=[2**31]),
    "shape no list": made(shape=5),
    "reconstruction no number": made(reconstruction='{"a": NaN}'),
    "reconstruction huge": made(reconstruction='{"a": 1' + "0" * 5000 + "}"),
    "reconstruction a list": made(reconstruction="[1]"),
    "reconstruction a number": made(reconstruction="1"),
    "reconstruction nested": made(reconstruction="[" * 50_000),
    "id of 3 MB": made(recording_id="x" * 3_000_000),
    "id a number": made(recording_id=5),
    "title null": made(title=None),
    "nested": '{"attributes":' + "[" * 100_000,
    "attributes a list": '{"attributes": []}',
    "a list": "[]",
    "a number": "5",
    "nothing": "",
    "no text": b"\xff\xfe{}",
    "longer than is read": '{"attributes": {}, "x": "' + "x" * 5_000_000 + '"}',
    "metadata a number": json.dumps(GOOD | {"consolidated_metadata": {"metadata": 5}}),
    "metadata a text": json.dumps(GOOD | {"consolidated_metadata": "x"}),
}


@pytest.mark.parametrize(
    ("stated", "expected"),
    [(True, True), (False, False), (None, False), ("true", False), (1, False)],
)
def test_a_store_has_every_chunk_where_it_says_so(
    tmp_path: Path, stated: object, *, expected: bool
) -> None:
    lay(tmp_path, "good", made(every_chunk_is_written=stated))
    lay(tmp_path, "older", made())

    chunks = {each.id: each.has_every_chunk for each in ProductStores(tmp_path).all()}

    assert chunks == {"good": expected, "older": False}


@pytest.mark.parametrize("text", DAMAGED.values(), ids=DAMAGED)
def test_a_store_that_cannot_be_read_says_why_and_hides_no_other(
    tmp_path: Path, text: str | bytes
) -> None:
    lay(tmp_path, "bad", text)
    lay(tmp_path, "good", made(title="<img src=x onerror=alert(1)>\x1b]0;x\x07\u202e"))

    bad, good = ProductStores(tmp_path).all()
    body = ProductStoresDocument.model_validate({"directory": "d", "stores": [bad, good]})
    listed = json.loads(body.model_dump_json())["stores"]

    assert [each["id"] for each in listed] == ["bad", "good"]
    assert (listed[0]["state"], listed[0]["products"]) == ("damaged", [])
    assert 0 < len(listed[0]["problem"]) <= 300
    assert (listed[1]["state"], listed[1]["problem"], listed[1]["bins"]) == ("complete", None, 16)
    assert ProductStores(tmp_path).find("bad") is None
    assert ProductStores(tmp_path).find("good") is not None


def _pipe(store: Path) -> None:
    os.mkfifo(store / "zarr.json")


def _directory(store: Path) -> None:
    (store / "zarr.json").mkdir()


def _loop(store: Path) -> None:
    (store / "zarr.json").symlink_to("zarr.json")


@pytest.mark.parametrize("make", [_pipe, _directory, _loop, lambda store: None])
def test_what_has_no_metadata_yet_is_no_store(tmp_path: Path, make: Callable[[Path], None]) -> None:
    store = tmp_path / "made.zarr"
    store.mkdir()
    make(store)
    (tmp_path / "a file.zarr").write_text("no directory")
    (tmp_path / "file.zarr").write_text("no directory")
    (tmp_path / "link.zarr").symlink_to(tmp_path)
    lay(tmp_path, "other", json.dumps({"zarr_format": 3, "attributes": {"format": "of others"}}))
    lay(tmp_path, "good", made())

    assert [each.id for each in ProductStores(tmp_path).all() if each.problem is None] == ["good"]
