"""Recordings as Zarr stores over HTTP, with zarr-python, xarray and Dask as clients."""

from collections.abc import Iterator
from pathlib import Path

import aiohttp
import h5py
import httpx
import numpy as np
import pytest
import xarray
from fastapi import FastAPI
from starlette.types import ASGIApp, Receive, Scope, Send

from tests.server.contract import client_of
from tests.server.recording.made import record
from tests.serving import Served, serving
from tests.waiting import wait_until

FRAMES = 4
pytestmark = pytest.mark.usefixtures("zarr_clients")
RECORDINGS = "/api/v1/recordings"
STORE = f"{RECORDINGS}/kept/zarr"
requested: list[str] = []


class Requests:
    """Notes the path of every request."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            requested.append(scope["path"])
        await self._app(scope, receive, send)


def note_requests(app: FastAPI) -> None:
    app.add_middleware(Requests)


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("recordings")
    record(directory / "kept.h5", FRAMES)
    return directory


@pytest.fixture(scope="module")
def daemon(directory: Path) -> Iterator[Served]:
    kept = {"directory": directory, "min_free_bytes": 0}
    with serving(prepare=note_requests, recordings=kept) as served:
        yield served


@pytest.fixture(scope="module")
def http(daemon: Served) -> Iterator[httpx.Client]:
    with client_of(daemon) as client:
        yield client


def test_xarray_opens_all_that_is_in_the_file_and_reads_what_is_indexed(
    daemon: Served, directory: Path
) -> None:
    dataset = xarray.open_zarr(daemon.url + STORE)
    requested.clear()
    images = dataset["raw"][2].to_numpy()

    assert requested == [f"{STORE}/raw/2.0.0.0"]
    with h5py.File(directory / "kept.h5") as file:
        np.testing.assert_array_equal(images, file["raw"][2])
        assert (np.diff(dataset["captured_unix_s"]) > 0).all()  # by the clock of the camera
        for name, variable in dataset.drop_vars("captured_unix_s").variables.items():
            np.testing.assert_array_equal(variable.to_numpy(), file[str(name)][()])
            assert variable.dtype == file[str(name)].dtype
        assert dataset["raw"].dims == ("frame", "image", "y", "x")
        assert dataset.attrs["sequence"] == file.attrs["sequence"]


def test_dask_computes_over_all_frames(daemon: Served, directory: Path) -> None:
    dataset = xarray.open_zarr(daemon.url + STORE, chunks={})

    mean = dataset["raw"].mean("frame").compute()

    with h5py.File(directory / "kept.h5") as file:
        np.testing.assert_allclose(mean.to_numpy(), file["raw"][()].mean(0), rtol=1e-12)


def test_what_a_client_has_is_not_sent_again_and_ranges_are(http: httpx.Client) -> None:
    key = f"{STORE}/raw/1.0.0.0"
    whole = http.get(key)
    tag = whole.headers["etag"]
    first = {"range": "bytes=10-19"}

    assert http.get(key, headers={"if-none-match": tag}).status_code == 304
    assert http.get(f"{STORE}/raw/2.0.0.0", headers={"if-none-match": tag}).status_code == 200
    part = http.get(key, headers=first | {"if-range": tag})
    assert (part.status_code, part.content) == (206, whole.content[10:20])
    size = len(whole.content)
    assert part.headers["content-range"] == f"bytes 10-19/{size}"
    last = http.get(key, headers={"range": "bytes=-7"})
    assert last.content == whole.content[-7:]
    assert http.get(key, headers={"range": "bytes=7-"}).content == whole.content[7:]
    assert http.get(key, headers={"range": f"bytes=7-{2 * size}"}).content == whole.content[7:]
    assert http.get(key, headers=first | {"if-range": '"other"'}).content == whole.content
    beyond = http.get(key, headers={"range": f"bytes={size}-"})
    assert (beyond.status_code, beyond.json()["limit"]) == (416, size)
    assert http.head(key).headers["content-length"] == str(size)


@pytest.mark.parametrize("key", ["none/.zarray", ".zarray", "zarr.json", "raw/zarr.json"])
def test_a_document_that_is_not_there_is_not_found(http: httpx.Client, key: str) -> None:
    assert http.get(f"{STORE}/{key}").json()["type"] == "/problems/not-found"


@pytest.mark.parametrize(
    "key", ["kept/zarr/raw/4.0.0.0", "kept/zarr/raw/0", "none/zarr/raw/0.0.0.0"]
)
def test_a_chunk_that_is_not_there_is_gone_and_not_only_not_found(
    http: httpx.Client, key: str
) -> None:
    answer = http.get(f"{RECORDINGS}/{key}")

    assert (answer.status_code, answer.json()["type"]) == (410, "/problems/store-gone")


def test_a_recording_that_was_deleted_while_it_was_read_is_no_zeros(
    daemon: Served, directory: Path
) -> None:
    path = record(directory / "short.h5", 2)
    dataset = xarray.open_zarr(f"{daemon.url}{RECORDINGS}/short/zarr", chunks=None)
    assert dataset["raw"][0].to_numpy().any()
    path.unlink()

    with pytest.raises(aiohttp.ClientResponseError, match="410"):
        dataset["raw"][1].to_numpy()
    with pytest.raises(FileNotFoundError):
        xarray.open_zarr(f"{daemon.url}{RECORDINGS}/short/zarr", chunks=None)


def test_a_recording_whose_daemon_is_gone_is_no_zeros(directory: Path) -> None:
    with serving(recordings={"directory": directory, "min_free_bytes": 0}) as served:
        dataset = xarray.open_zarr(served.url + STORE, chunks=None)

    with pytest.raises(aiohttp.ClientConnectionError):
        dataset["raw"][1].to_numpy()


def test_what_is_no_recording_has_no_keys(http: httpx.Client, directory: Path) -> None:
    (directory / "no.h5").write_bytes(b"no recording")

    for name, problem in (("none", "unknown-recording"), ("no", "recording-damaged")):
        answer = http.get(f"{RECORDINGS}/{name}/zarr/.zmetadata")
        assert answer.json()["type"] == f"/problems/{problem}"


def test_a_damaged_chunk_is_an_error_of_the_client_and_never_zeros(
    daemon: Served, http: httpx.Client, directory: Path
) -> None:
    path = record(directory / "torn.h5", 2)
    with h5py.File(path) as file:
        place = file["raw"].id.get_chunk_info_by_coord((1, 0, 0, 0))
    with path.open("r+b") as stream:
        stream.seek(place.byte_offset + 40)
        stream.write(bytes(64))
    dataset = xarray.open_zarr(f"{daemon.url}{RECORDINGS}/torn/zarr", chunks=None)

    assert dataset["raw"][0].to_numpy().any()
    with pytest.raises(Exception, match=r"decompress"):
        dataset["raw"][1].to_numpy()


def test_a_chunk_that_the_file_lacks_is_a_problem_that_clients_raise(
    daemon: Served, http: httpx.Client, directory: Path
) -> None:
    record(directory / "whole.h5", 2)
    with h5py.File(directory / "whole.h5") as file, h5py.File(directory / "lacks.h5", "w") as other:
        other.attrs.update(file.attrs)
        for name in file.keys() - {"raw"}:
            file.copy(name, other)
        shape = file["raw"].shape
        other.create_dataset("raw", shape, "<u2", chunks=(1, *shape[1:]), compression="gzip")
    answer = http.get(f"{RECORDINGS}/lacks/zarr/raw/1.0.0.0")
    dataset = xarray.open_zarr(f"{daemon.url}{RECORDINGS}/lacks/zarr", chunks=None)

    assert answer.json()["type"] == "/problems/recording-damaged"
    with pytest.raises(aiohttp.ClientResponseError):
        dataset["raw"][1].to_numpy()


def test_a_recording_is_read_while_it_is_written_and_grows(
    daemon: Served, http: httpx.Client
) -> None:
    def frames() -> int:
        return int(http.get(f"{RECORDINGS}/{name}").json()["frames"])

    http.get("/api/v1/frames/latest", params={"wait_s": 10.0})
    name = http.post(RECORDINGS, json={"name": "grows"}).json()["id"]
    store = f"{RECORDINGS}/{name}/zarr"
    wait_until(lambda: frames() >= 2)
    before = xarray.open_zarr(daemon.url + store, chunks=None)
    tag = http.get(f"{store}/.zmetadata").headers["etag"]
    images = before["raw"][1].to_numpy()
    known = before.sizes["frame"]
    wait_until(lambda: frames() > known)
    after = xarray.open_zarr(daemon.url + store, chunks=None)

    assert after.sizes["frame"] > known >= 2
    assert http.get(f"{store}/.zmetadata", headers={"if-none-match": tag}).status_code == 200
    times = before["host_time_s"].to_numpy()  # of a file that has grown since
    np.testing.assert_array_equal(times, after["host_time_s"].to_numpy()[:known])
    http.post(f"{RECORDINGS}/{name}/stop")
    np.testing.assert_array_equal(after["raw"][1].to_numpy(), images)


def test_a_store_needs_the_token_that_the_recording_needs(directory: Path) -> None:
    with serving(require_token=True, recordings={"directory": directory}) as served:
        assert httpx.get(f"{served.url}{STORE}/.zmetadata").status_code == 401
