"""What switches the light off, through relays whose network fails: the light is the device's."""

import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import pytest

import transientcam
from tests.server.relay.forwarder import Forwarder, forwarding
from tests.server.streaming import VIDEO
from tests.serving import Served, serving
from tests.waiting import wait_until
from transientcam_server.camera import _origin_lease as origin_lease
from transientcam_server.errors import OriginRefused
from transientcam_server.relay import _delivery as delivery

ORIGIN = "sim:wall?noise=off"
PATIENCE_S = 60.0
ACQUISITION = "/api/v1/acquisition"
SAFE_OFF = f"{ACQUISITION}/safe-off"


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(delivery, "PAUSES_S", (0.1,))


@pytest.fixture(scope="module")
def origin() -> Iterator[Served]:
    with serving(ORIGIN, sequence=VIDEO) as daemon:
        daemon.start_all_workers()
        yield daemon


@pytest.fixture
def lit(origin: Served) -> Served:
    with transientcam.Camera(origin.url, timeout_s=PATIENCE_S) as camera:
        camera.start()
    wait_until(lambda: is_lit(origin))
    return origin


@pytest.fixture
def link(lit: Served) -> Iterator[Forwarder]:
    with forwarding(lit.url) as forwarder:
        yield forwarder


@pytest.fixture
def relay(link: Forwarder) -> Iterator[Served]:
    with behind(link) as daemon:
        wait_until(lambda: acquisition(daemon)["state"] == "streaming")
        yield daemon
        link.admitting = True
        link.speak()


def behind(link: Forwarder, **settings: Any) -> Any:
    return serving(f"relay:{link.url}?timeout_s={PATIENCE_S:g}", **settings)


def is_lit(origin: Served) -> bool:
    """Ask the device itself, past every service."""
    return origin.camera.status().light_on


def send(served: Served, method: str, path: str, *, wait_s: float = 0.0, **body: Any) -> Any:
    answer = httpx.request(
        method,
        served.url + path,
        headers={"Prefer": f"wait={wait_s:g}"},
        json=body or None,
        timeout=PATIENCE_S,
    )
    return answer.status_code, answer.json()


def acquisition(served: Served) -> dict[str, Any]:
    document: dict[str, Any] = httpx.get(served.url + ACQUISITION, timeout=PATIENCE_S).json()
    return document


def says_that_it_may_be_on(served: Served) -> bool:
    said = acquisition(served)
    return said["switching_off"] is True and "the light may be on" in said["reason"]


OFF = {
    "safe-off": partial(send, method="POST", path=SAFE_OFF),
    "stop": partial(send, method="PUT", path=ACQUISITION, running=False),
}


@pytest.mark.parametrize("off", OFF.values(), ids=list(OFF))
def test_a_silent_network_delays_it_and_the_relay_says_that_the_light_may_be_on(
    lit: Served, link: Forwarder, relay: Served, off: Callable[..., Any]
) -> None:
    link.silence()
    status, document = off(relay)
    assert (status, document["type"]) == (504, "/problems/light-unconfirmed")
    assert is_lit(lit)
    assert says_that_it_may_be_on(relay)

    link.speak()
    wait_until(lambda: not is_lit(lit))
    wait_until(lambda: not acquisition(relay)["switching_off"])
    wait_until(lambda: acquisition(relay)["state"] == "stopped")


def test_what_was_on_its_way_may_be_lost(lit: Served, link: Forwarder, relay: Served) -> None:
    link.silence()
    assert send(relay, "POST", SAFE_OFF)[0] == 504
    link.cut()
    link.speak()
    wait_until(lambda: not is_lit(lit))


def test_an_origin_that_is_lost_is_switched_off_as_soon_as_it_is_there(
    lit: Served, link: Forwarder, relay: Served
) -> None:
    link.admitting = False
    link.cut()
    wait_until(lambda: acquisition(relay)["state"] == "lost")
    assert send(relay, "POST", SAFE_OFF)[0] == 504
    assert is_lit(lit)
    assert says_that_it_may_be_on(relay)

    link.admitting = True
    wait_until(lambda: not is_lit(lit))
    wait_until(lambda: acquisition(relay)["state"] == "stopped")


def test_an_answer_is_a_success_only_once_the_light_is_off(
    lit: Served, link: Forwarder, relay: Served
) -> None:
    status, document = send(relay, "POST", SAFE_OFF, wait_s=PATIENCE_S)
    assert not is_lit(lit)
    assert (status, document["state"], document["switching_off"]) == (200, "stopped", False)


def test_it_waits_for_nothing_else_that_the_relay_asks_of_its_origin(
    lit: Served, relay: Served
) -> None:
    """The camera's thread waits for something, on and on."""
    begun, end = threading.Event(), threading.Event()

    def wait() -> None:
        begun.set()
        end.wait(PATIENCE_S)

    stuck = relay.service.acquisition.submit(wait)
    assert begun.wait(PATIENCE_S)
    status, document = send(relay, "POST", SAFE_OFF, wait_s=PATIENCE_S)
    assert (status, document["state"]) == (200, "stopped")
    assert not is_lit(lit)
    assert not stuck.done()
    end.set()


def test_a_start_afterwards_ends_it(lit: Served, link: Forwarder, relay: Served) -> None:
    link.admitting = False  # connections that stand are good, each attempt is a new one
    assert send(relay, "POST", SAFE_OFF)[0] == 504
    assert says_that_it_may_be_on(relay)
    with transientcam.Camera(relay.url, timeout_s=PATIENCE_S) as camera:
        assert not camera.start()["switching_off"]
    link.admitting = True
    assert is_lit(lit)
    assert not acquisition(relay)["switching_off"]


def test_a_start_that_was_asked_for_before_does_not(
    lit: Served, link: Forwarder, relay: Served
) -> None:
    before = relay.service.relay
    assert before is not None
    offs = before.offs
    assert send(relay, "POST", SAFE_OFF, wait_s=PATIENCE_S)[0] == 200
    assert not before.start_unless(offs)
    assert not is_lit(lit)


def test_a_start_that_it_overtakes_on_the_way_does_not(
    lit: Served, link: Forwarder, relay: Served
) -> None:
    """The relay has asked for it, and its network delivers what switches off first."""
    before = relay.service.relay
    assert before is not None
    seen = before._link.offs()
    assert send(relay, "POST", SAFE_OFF, wait_s=PATIENCE_S)[0] == 200
    with pytest.raises(OriginRefused, match="switched off after this"):
        before._link.start(offs=seen)
    assert not is_lit(lit)


@pytest.mark.parametrize("off", OFF.values(), ids=list(OFF))
def test_what_was_not_confirmed_is_repeated_after_a_restart_and_once_only(
    lit: Served, link: Forwarder, tmp_path: Path, off: Callable[..., Any]
) -> None:
    kept = {"light": {"directory": tmp_path}}
    with behind(link, **kept) as relay:
        link.admitting = False  # connections that stand are good, each attempt is a new one
        assert off(relay)[0] == 504
    link.admitting = True
    assert is_lit(lit)
    with behind(link, **kept) as relay:
        wait_until(lambda: not is_lit(lit))
        wait_until(lambda: not acquisition(relay)["switching_off"])
    with transientcam.Camera(lit.url, timeout_s=PATIENCE_S) as camera:
        camera.start()
    wait_until(lambda: is_lit(lit))
    with behind(link, **kept) as relay:
        wait_until(lambda: acquisition(relay)["state"] == "streaming")
        assert not acquisition(relay)["switching_off"]
    assert is_lit(lit)


def test_it_goes_through_three_relays_at_once(lit: Served) -> None:
    with ExitStack() as stack:
        last = stack.enter_context(forwarding(lit.url))
        hops = [stack.enter_context(behind(last))]
        for _ in range(2):
            between = stack.enter_context(forwarding(hops[-1].url))
            hops.append(stack.enter_context(behind(between)))
        last.silence()
        status, document = send(hops[-1], "POST", SAFE_OFF)
        assert (status, document["type"]) == (504, "/problems/light-unconfirmed")
        wait_until(lambda: SAFE_OFF.encode() in last.seen)  # it came to the last network
        assert all(map(says_that_it_may_be_on, hops))
        assert is_lit(lit)

        last.speak()
        wait_until(lambda: not is_lit(lit))
        wait_until(lambda: not any(acquisition(each)["switching_off"] for each in hops))


def test_a_lease_is_given_back_as_soon_as_the_network_speaks(
    lit: Served, link: Forwarder, relay: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(origin_lease, "RELEASED_S", 0.1)
    lease: dict[str, Any] = {"holder": "bench", "duration_s": 3600.0}
    status, granted = send(relay, "POST", "/api/v1/lease", **lease)
    assert status == 201
    link.silence()
    answer = httpx.delete(
        f"{relay.url}/api/v1/lease",
        headers={"Transientcam-Lease": granted["lease_id"]},
        timeout=PATIENCE_S,
    )
    assert answer.status_code == 200
    link.speak()
    lease_there = f"{lit.url}/api/v1/lease"
    wait_until(lambda: httpx.get(lease_there, timeout=PATIENCE_S).json()["held"] is False)
