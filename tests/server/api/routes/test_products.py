"""Stores of products over HTTP, as `transientcam reconstruct` writes them beside the recordings."""

import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import aiohttp
import httpx
import numpy as np
import pytest
import xarray

from tests.server.contract import client_of
from tests.server.recording.made import record
from tests.serving import Served, serving
from transientcam.cli import run
from transientcam_server.recording import ProductStores

FRAMES = 3
pytestmark = pytest.mark.usefixtures("zarr_clients")
PRODUCTS = "/api/v1/products"
STORE = f"{PRODUCTS}/kept/zarr"
CHUNK = "range/c/1/0/0"


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("recordings")
    source = record(directory / "kept.h5", FRAMES)
    wanted = ["--product", "range", "--product", "flags"]
    assert run(["reconstruct", str(source), "-o", str(directory / "kept.zarr"), *wanted]) == 0
    return directory


@pytest.fixture(scope="module")
def daemon(directory: Path) -> Iterator[Served]:
    with serving(recordings={"directory": directory}) as served:
        yield served


@pytest.fixture(scope="module")
def http(daemon: Served) -> Iterator[httpx.Client]:
    with client_of(daemon) as client:
        yield client


def begun(store: Path) -> Path:
    """Make a store one that is not complete."""
    document = json.loads((store / "zarr.json").read_text())
    del document["consolidated_metadata"]
    (store / "zarr.json").write_text(json.dumps(document))
    return store


def test_xarray_reads_over_http_what_was_written(daemon: Served, directory: Path) -> None:
    found = xarray.open_zarr(daemon.url + STORE, chunks=None)

    with xarray.open_zarr(directory / "kept.zarr", chunks=None) as written:
        assert set(found.variables) == set(written.variables) >= {"range", "flags", "frame"}
        for name, variable in written.variables.items():
            np.testing.assert_array_equal(found[name].to_numpy(), variable.to_numpy())
            assert found[name].dims == variable.dims
        assert found.attrs == written.attrs
    assert np.isfinite(found["range"].to_numpy()).any()


def test_the_list_says_whose_products_a_store_has(http: httpx.Client, directory: Path) -> None:
    (kept,) = (each for each in http.get(PRODUCTS).json()["stores"] if each["id"] == "kept")
    recording = http.get("/api/v1/recordings/kept").json()

    assert kept["products"] == ["range", "flags"]
    assert (kept["frames"], kept["state"], kept["bins"]) == (FRAMES, "complete", 256)
    assert kept["name"] == recording["name"]
    assert "bias" in kept["reconstruction"]


def test_chunks_are_the_bytes_of_the_store_and_are_sent_once(
    http: httpx.Client, directory: Path
) -> None:
    stored = (directory / "kept.zarr" / CHUNK).read_bytes()
    whole = http.get(f"{STORE}/{CHUNK}")
    tag, size = whole.headers["etag"], len(stored)
    first = {"range": "bytes=10-19"}

    assert whole.content == stored
    assert http.head(f"{STORE}/{CHUNK}").headers["content-length"] == str(size)
    again = http.get(f"{STORE}/{CHUNK}", headers={"if-none-match": tag})
    assert (again.status_code, again.content) == (304, b"")
    part = http.get(f"{STORE}/{CHUNK}", headers=first | {"if-range": tag})
    assert (part.status_code, part.content) == (206, stored[10:20])
    assert http.get(f"{STORE}/{CHUNK}", headers={"range": "bytes=-7"}).content == stored[-7:]
    assert http.get(f"{STORE}/{CHUNK}", headers=first | {"if-range": '"x"'}).content == stored
    beyond = http.get(f"{STORE}/{CHUNK}", headers={"range": f"bytes={size}-"})
    assert (beyond.status_code, beyond.json()["limit"]) == (416, size)


def test_a_chunk_that_was_written_anew_has_another_tag(http: httpx.Client, directory: Path) -> None:
    path = directory / "kept.zarr" / CHUNK
    tag = http.get(f"{STORE}/{CHUNK}").headers["etag"]
    other = path.with_name("other")
    shutil.copy(path, other)
    other.replace(path)

    assert http.get(f"{STORE}/{CHUNK}", headers={"if-none-match": tag}).status_code == 200


@pytest.mark.parametrize(
    "key",
    [
        ".zgroup",
        ".zmetadata",
        "range/.zarray",
        "none/zarr.json",
        "..%2Fkept.h5",
        "range/..%2F..%2Fkept.h5",
    ],
)
def test_what_is_no_key_is_not_found(http: httpx.Client, key: str) -> None:
    assert http.get(f"{STORE}/{key}").json()["type"] == "/problems/not-found"


@pytest.mark.parametrize(
    "key",
    [
        "kept/zarr/range/c/3/0/0",
        "kept/zarr/range/c/01/0/0",
        "kept/zarr/range/c/1/0",
        "kept/zarr/none/c/0",
        "kept/zarr/range/c/1/0/zarr.json",
        "kept/zarr/range/c/..%2F..%2F..%2Fkept.h5",
        f"none/zarr/{CHUNK}",
        f"kept~0123456789ab/zarr/{CHUNK}",
    ],
)
def test_a_chunk_that_no_metadata_name_is_gone(http: httpx.Client, key: str) -> None:
    answer = http.get(f"{PRODUCTS}/{key}")

    assert (answer.status_code, answer.json()["type"]) == (410, "/problems/store-gone")


def test_a_store_that_another_has_replaced_is_not_read_further(
    daemon: Served, http: httpx.Client, directory: Path
) -> None:
    store = directory / "replaced.zarr"
    shutil.copytree(directory / "kept.zarr", store)
    stores = http.get(PRODUCTS).json()["stores"]
    (generation,) = (each["generation"] for each in stores if each["id"] == "replaced")
    url = f"{daemon.url}{PRODUCTS}/replaced~{generation}/zarr"
    dataset = xarray.open_zarr(url, chunks=None)
    assert np.isfinite(dataset["range"][0].to_numpy()).any()
    document = json.loads((store / "zarr.json").read_text())
    document["attributes"]["title"] = "of other settings"
    (store / "zarr.json").write_text(json.dumps(document))

    with pytest.raises(aiohttp.ClientResponseError, match="410"):
        dataset["range"][1].to_numpy()


def test_a_chunk_that_is_being_deleted_is_no_zeros(daemon: Served, directory: Path) -> None:
    store = directory / "halved.zarr"
    shutil.copytree(directory / "kept.zarr", store)
    dataset = xarray.open_zarr(f"{daemon.url}{PRODUCTS}/halved/zarr", chunks=None)
    shutil.rmtree(store / "range" / "c" / "1")

    with pytest.raises(aiohttp.ClientResponseError, match="410"):
        dataset["range"][1].to_numpy()


def test_a_chunk_that_older_versions_left_out_has_the_fill_value(
    http: httpx.Client, directory: Path
) -> None:
    store = directory / "older.zarr"
    shutil.copytree(directory / "kept.zarr", store)
    document = json.loads((store / "zarr.json").read_text())
    del document["attributes"]["every_chunk_is_written"]
    (store / "zarr.json").write_text(json.dumps(document))
    (store / CHUNK).unlink()

    assert http.get(f"{PRODUCTS}/older/zarr/{CHUNK}").status_code == 404
    assert http.get(f"{PRODUCTS}/older/zarr/range/c/3/0/0").status_code == 410


def test_a_link_does_not_lead_out_of_a_store(http: httpx.Client, directory: Path) -> None:
    linked = directory / "linked.zarr"
    shutil.copytree(directory / "kept.zarr", linked)
    (linked / "range" / "c" / "9").symlink_to(directory)
    (linked / "away").symlink_to(directory / "kept.zarr" / "range")
    (directory / "whole.zarr").symlink_to(directory / "kept.zarr")

    assert http.get(f"{PRODUCTS}/linked/zarr/{CHUNK}").status_code == 200
    assert http.get(f"{PRODUCTS}/linked/zarr/away/zarr.json").status_code == 404
    assert http.get(f"{PRODUCTS}/whole/zarr/zarr.json").status_code == 404


def test_a_store_that_is_not_complete_is_refused_and_never_read_as_zeros(
    daemon: Served, http: httpx.Client, directory: Path
) -> None:
    begun(Path(shutil.copytree(directory / "kept.zarr", directory / "begun.zarr")))

    (listed,) = (each for each in http.get(PRODUCTS).json()["stores"] if each["id"] == "begun")
    assert (listed["state"], listed["frames"]) == ("unfinished", FRAMES)
    answer = http.get(f"{PRODUCTS}/begun/zarr/{CHUNK}")
    assert answer.json()["type"] == "/problems/product-store-unfinished"
    with pytest.raises(aiohttp.ClientResponseError, match="409"):
        xarray.open_zarr(f"{daemon.url}{PRODUCTS}/begun/zarr", chunks=None)


def test_what_reconstruct_did_not_write_is_no_store(http: httpx.Client, directory: Path) -> None:
    known = {each["id"] for each in http.get(PRODUCTS).json()["stores"]}
    for name, text in {
        "other": '{"zarr_format": 3, "attributes": {"format": "mine"}}',
        "broken": "{",
        "list": "[]",
        "deep": "[" * 100_000,
        "short": '{"attributes": {"format": "transientcam products", "products": "[]"}}',
    }.items():
        (directory / f"{name}.zarr").mkdir()
        (directory / f"{name}.zarr" / "zarr.json").write_text(text)
    (directory / "pipe.zarr").mkdir()
    os.mkfifo(directory / "pipe.zarr" / "zarr.json")
    (directory / "file.zarr").touch()

    stores = http.get(PRODUCTS).json()["stores"]
    assert {each["id"] for each in stores if each["state"] != "damaged"} == known
    assert {each["id"] for each in stores} - known == {"broken", "list", "deep", "short"}
    for name in ("other", "deep", "pipe", "file", "none", "..%2Fkept"):
        assert http.get(f"{PRODUCTS}/{name}/zarr/zarr.json").status_code == 404


def test_a_directory_that_is_not_there_has_no_stores(tmp_path: Path) -> None:
    assert ProductStores(tmp_path / "none").all() == []


def test_a_store_needs_the_token_that_recordings_need(directory: Path) -> None:
    with serving(require_token=True, recordings={"directory": directory}) as served:
        assert httpx.get(f"{served.url}{STORE}/zarr.json").status_code == 401
