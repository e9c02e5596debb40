"""What tests of a daemon that a whole module shares ask it with."""

from collections.abc import Iterator

import httpx
import pytest

from tests.server.contract import client_of
from tests.serving import Served


@pytest.fixture(scope="module")
def http(daemon: Served) -> Iterator[httpx.Client]:
    """Return a client of the module's daemon."""
    with client_of(daemon) as client:
        yield client
