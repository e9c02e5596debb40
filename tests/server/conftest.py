"""A daemon for each test that asks for one, and a client that holds its answers to the contract."""

from collections.abc import Iterator

import httpx
import pytest

from tests.server.contract import hold_to_contract
from tests.serving import Served, serving


@pytest.fixture
def served() -> Iterator[Served]:
    """A daemon with the built-in scene `mirrors`, without noise, at the paper's video setting."""
    with serving("sim:mirrors?noise=off") as daemon:
        yield daemon


@pytest.fixture
def http(served: Served) -> Iterator[httpx.Client]:
    """A client whose every answer is checked against the daemon's own OpenAPI document."""
    with httpx.Client(base_url=served.url, timeout=20.0) as client:
        hold_to_contract(client, served.app.openapi())
        yield client
