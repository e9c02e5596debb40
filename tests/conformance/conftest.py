"""One daemon for the checks, which can be made to break its promises."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tests.conformance.breaking import NOTHING, Breaker
from tests.serving import Served, serving
from transientcam.wire import LEASE_HEADER
from transientcam_conformance import Device
from transientcam_conformance._device import API

CAMERA = "sim:wall?noise=off"  # the scene that is rendered quickest


@dataclass(frozen=True)
class Breakable:
    """A daemon, and what can break it."""

    served: Served
    breaker: Breaker


@contextmanager
def breakable_daemon(recordings: Path, **settings: Any) -> Iterator[Breakable]:
    """Run a daemon with a simulated camera that can be broken."""
    breaker = Breaker()
    kept = {"directory": recordings, "min_free_bytes": 0}
    with serving(CAMERA, prepare=breaker.install, recordings=kept, **settings) as served:
        served.start_all_workers()  # or a test would be taken to have left them behind
        yield Breakable(served, breaker)


# not for the session: it would capture on beside all tests that come after these
@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Breakable]:
    """One daemon for all tests of a file."""
    with breakable_daemon(tmp_path_factory.mktemp("recordings")) as made:
        yield made


@pytest.fixture
def breakable(daemon: Breakable) -> Iterator[Breakable]:
    """The same, which is as it was again after the test."""
    with Device(daemon.served.url) as device:
        before = device.state()
        yield daemon
        daemon.breaker.current = NOTHING
        if device.state() != before or device.read(f"{API}/lease")["held"]:
            restore(device, before)


def restore(device: Device, before: dict[str, Any]) -> None:
    """Set a camera back that broke its promise to do so itself."""
    terms = {"holder": "the tests", "takeover": True}
    lease = device.document(device.send("POST", f"{API}/lease", json=terms), status=201)
    own = {LEASE_HEADER: lease["lease_id"]}
    wanted = {"running": before["running"]}
    device.send("PUT", f"{API}/sequence", json=before["sequence"], headers=own)
    device.send("PUT", f"{API}/acquisition", json=wanted, headers=own)
    device.send("DELETE", f"{API}/lease", headers=own)
    assert device.state() == before
