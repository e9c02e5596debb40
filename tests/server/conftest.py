"""A daemon for each test that uses it, and a client that holds its answers to the contract."""

import asyncio
from collections.abc import Iterator

import dask
import httpx
import pytest
from fsspec.implementations.http import HTTPFileSystem
from fsspec.implementations.reference import ReferenceFileSystem
from zarr.core.sync import cleanup_resources, loop

from tests.server.contract import client_of
from tests.serving import Served, serving
from transientcam_server import offline
from transientcam_server.offline import _job as job


@pytest.fixture(scope="module", autouse=True)
def nothing_compiled_for_a_verb() -> Iterator[None]:
    """Let no verb that computes a recording compile a dozen kernels for a few small frames."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (offline, job):
            patch.setattr(module, "load_kernels", lambda recipe: None)
        yield


@pytest.fixture
def served() -> Iterator[Served]:
    """A daemon with the built-in scene `mirrors`, without noise, at the paper's video setting."""
    with serving("sim:mirrors?noise=off") as daemon:
        yield daemon


@pytest.fixture(scope="module")
def steady_daemon() -> Iterator[Served]:
    """A daemon that all tests of a module share: for those that change nothing."""
    with serving("sim:mirrors?noise=off") as daemon:
        daemon.start_all_workers()  # or a test would be taken to have left them behind
        yield daemon


@pytest.fixture(scope="module")
def steady(steady_daemon: Served) -> Iterator[httpx.Client]:
    """A client of the shared daemon, which has a frame already."""
    with client_of(steady_daemon) as client:
        client.get("/api/v1/frames/latest", params={"wait_s": 10.0})
        yield client


@pytest.fixture(scope="module")
def steady_stream(steady_daemon: Served) -> str:
    """Address of the shared daemon's stream."""
    return steady_daemon.stream_url


@pytest.fixture(scope="module")
def zarr_clients() -> Iterator[None]:
    """Clients that compute on the thread that asks, and keep no connection afterwards."""
    with dask.config.set(scheduler="synchronous"):
        yield
    if loop[0] is not None:  # reads that a failed one beside them left behind
        asyncio.run_coroutine_threadsafe(_others_are_done(), loop[0]).result()
    # what fsspec keeps for the life of the process belongs to the loop that ends below
    for each in (HTTPFileSystem, ReferenceFileSystem):
        for system in each._cache.values():
            session = getattr(system, "_session", None)
            if session is not None:
                asyncio.run_coroutine_threadsafe(session.close(), session._loop).result()
        each.clear_instance_cache()
    cleanup_resources()


async def _others_are_done() -> None:
    others = asyncio.all_tasks() - {asyncio.current_task()}
    if others:
        await asyncio.wait(others)


@pytest.fixture
def http(served: Served) -> Iterator[httpx.Client]:
    """A client whose every answer is checked against the daemon's own OpenAPI document."""
    with client_of(served) as client:
        yield client
