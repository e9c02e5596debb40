"""Requests that are sent until they are confirmed, against a network that the test makes fail."""

import asyncio
import queue
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future

import pytest

from tests.waiting import wait_until
from transientcam_driver import CameraLost
from transientcam_server.errors import OriginRefused
from transientcam_server.relay._delivery import Delivery

PATIENCE_S = 60.0
SOON: tuple[float, ...] = (0.001,)
NEVER: tuple[float, ...] = (PATIENCE_S,)
Outcome = Callable[[], object]


class Network:
    """Notes each attempt, and lets it wait for what the test has for it."""

    def __init__(self) -> None:
        self.attempts: queue.SimpleQueue[Future[None]] = queue.SimpleQueue()
        self.given_up = threading.Semaphore(0)
        self.told: list[bool] = []

    async def send(self) -> None:
        answer: Future[None] = Future()
        self.attempts.put(answer)
        try:
            await asyncio.wrap_future(answer)
        except asyncio.CancelledError:
            self.given_up.release()
            raise

    def attempt(self) -> "Future[None]":
        return self.attempts.get(timeout=PATIENCE_S)


@pytest.fixture
def network() -> Network:
    return Network()


@pytest.fixture
def deliver(network: Network) -> Iterator[Callable[[tuple[float, ...]], Delivery]]:
    made: list[Delivery] = []

    def make(pauses_s: tuple[float, ...]) -> Delivery:
        made.append(Delivery(network.send, changed=network.told.append, pauses_s=pauses_s))
        return made[-1]

    yield make
    for each in made:
        each.end("the test ends")
        each.join()


def test_a_request_is_sent_at_once_and_once_where_it_is_confirmed(
    network: Network, deliver: Callable[[tuple[float, ...]], Delivery]
) -> None:
    delivery = deliver(NEVER)
    confirmed = delivery.begin()
    network.attempt().set_result(None)

    confirmed.result(PATIENCE_S)
    delivery.join()
    assert not delivery.unconfirmed
    assert network.attempts.empty()
    assert network.told == []


def test_one_that_fails_or_is_not_answered_is_sent_again_until_one_is_confirmed(
    network: Network, deliver: Callable[[tuple[float, ...]], Delivery]
) -> None:
    delivery = deliver(SOON)
    confirmed = delivery.begin()
    network.attempt().set_exception(CameraLost("no route"))
    network.attempt()  # never answered
    network.attempt().set_exception(RuntimeError("anything"))
    last = network.attempt()
    assert delivery.unconfirmed
    assert not confirmed.done()
    last.set_result(None)

    confirmed.result(PATIENCE_S)
    delivery.join()
    assert network.given_up.acquire(timeout=PATIENCE_S)  # the one without an answer
    assert network.told == [False, True]


def test_a_refusal_ends_it(
    network: Network, deliver: Callable[[tuple[float, ...]], Delivery]
) -> None:
    delivery = deliver(NEVER)
    refused = delivery.begin()
    network.attempt().set_exception(OriginRefused("lab", {"detail": "no"}))

    with pytest.raises(OriginRefused):
        refused.result(PATIENCE_S)
    delivery.join()
    assert network.attempts.empty()


def test_an_answer_counts_for_those_who_asked_before_it_was_sent_for(
    network: Network, deliver: Callable[[tuple[float, ...]], Delivery]
) -> None:
    """Somebody may have started the capture between the first attempt and the second wish."""
    delivery = deliver(NEVER)
    first = delivery.begin()
    before = network.attempt()
    second = delivery.begin()
    after = network.attempt()  # at once, not behind a pause
    before.set_result(None)

    first.result(PATIENCE_S)
    assert not second.done()
    after.set_result(None)
    second.result(PATIENCE_S)


def test_it_can_be_ended_for_those_who_asked_before_something_and_not_for_others(
    network: Network, deliver: Callable[[tuple[float, ...]], Delivery]
) -> None:
    delivery = deliver(NEVER)
    before = delivery.begin()
    asked = delivery.asked
    network.attempt()
    after = delivery.begin()
    again = network.attempt()
    delivery.end("it was started", asked=asked)

    with pytest.raises(CameraLost, match="it was started"):
        before.result(PATIENCE_S)
    assert delivery.unconfirmed
    again.set_result(None)
    after.result(PATIENCE_S)


def test_it_begins_anew_after_its_end(
    network: Network, deliver: Callable[[tuple[float, ...]], Delivery]
) -> None:
    delivery = deliver(NEVER)
    for _ in range(3):
        confirmed = delivery.begin()
        network.attempt().set_result(None)
        confirmed.result(PATIENCE_S)
    wait_until(lambda: not delivery.unconfirmed)


def test_of_very_many_wishes_the_latest_are_under_way(
    network: Network, deliver: Callable[[tuple[float, ...]], Delivery]
) -> None:
    delivery = deliver(SOON)
    delivery.begin()
    for _ in range(33):
        network.attempt()

    assert network.given_up.acquire(timeout=PATIENCE_S)
