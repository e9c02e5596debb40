"""Plans wait for one another, few at a time."""

import asyncio
import threading
from collections.abc import Callable
from contextlib import AsyncExitStack
from typing import Any

import pytest

from tests.conftest import ROOT
from transientcam_server.api import problem_response
from transientcam_server.errors import Problem, kinds
from transientcam_server.planning import PlanningQueue, Progress
from transientcam_server.planning._process.queue import MOST, MOST_OF_ONE, RETRY_AFTER_S, WAIT_S


class Held:
    """Computes nothing: each call returns its number once a test lets it."""

    def __init__(self) -> None:
        self.begun = self.prepared = 0
        self.left = threading.Event()
        self._free = threading.Semaphore(0)

    def run(self, compute: Callable[..., Any], *arguments: object, progress: Progress) -> Any:
        self.begun += 1
        number = self.begun
        self._free.acquire()
        return number

    def prepare(self) -> None:
        self.prepared += 1

    def leave(self) -> None:
        self.left.set()

    def close(self) -> None:
        for _ in range(10):
            self._free.release()

    def let_one_end(self) -> None:
        self._free.release()


async def begun(held: Held, count: int) -> None:
    """Wait until so many calls have begun."""
    while held.begun < count:
        await asyncio.sleep(0.001)


async def turns() -> None:
    """Let the loop do all that can be done now."""
    for _ in range(20):
        await asyncio.sleep(0)


def test_one_plan_is_computed_at_a_time() -> None:
    async def three() -> None:
        held = Held()
        queue = PlanningQueue(held)
        plans = [asyncio.create_task(queue.run(int, progress=Progress())) for _ in range(3)]
        for k, plan in enumerate(plans):
            await begun(held, k + 1)
            await turns()
            assert held.begun == k + 1
            held.let_one_end()
            assert await plan == k + 1

    asyncio.run(three())


def test_a_plan_that_is_given_up_lets_the_next_one_go_on() -> None:
    async def two() -> None:
        held = Held()
        queue = PlanningQueue(held)
        first, second = (asyncio.create_task(queue.run(int, progress=Progress())) for _ in range(2))
        await begun(held, 1)
        first.cancel()
        await begun(held, 2)
        held.close()
        assert await second == 2

    asyncio.run(two())


def test_after_a_while_without_plans_the_process_leaves() -> None:
    async def plan_and_wait() -> None:
        held = Held()
        held.let_one_end()
        queue = PlanningQueue(held, idle_s=0.0)
        await queue.run(int, progress=Progress())
        while not held.left.is_set():
            await asyncio.sleep(0.001)

    asyncio.run(plan_and_wait())


def test_a_process_that_is_ready_for_a_plan_that_never_comes_leaves() -> None:
    async def prepare_and_wait() -> None:
        held = Held()
        PlanningQueue(held, idle_s=0.0).prepare()
        assert held.prepared == 1
        while not held.left.is_set():
            await asyncio.sleep(0.001)

    asyncio.run(prepare_and_wait())


def test_no_process_is_made_ready_once_the_service_ends() -> None:
    async def end() -> None:
        held = Held()
        queue = PlanningQueue(held)
        await queue.close()
        queue.prepare()
        assert held.prepared == 0

    asyncio.run(end())


def test_there_are_as_many_places_as_the_page_states() -> None:
    text = " ".join((ROOT / "docs" / "service.md").read_text("utf-8").split())

    assert (MOST, MOST_OF_ONE) == (8, 4)
    assert "Eight such requests, four of one address, are queued" in text
    assert f"others wait for {WAIT_S:g} s and then fail with 503" in text


def test_an_address_has_few_places_and_leaves_some_to_others() -> None:
    async def fill() -> None:
        queue = PlanningQueue(Held(), wait_s=0.0)
        async with AsyncExitStack() as places:
            for _ in range(MOST_OF_ONE):
                await places.enter_async_context(queue.place_of("a"))
            with pytest.raises(Problem) as refused:
                await places.enter_async_context(queue.place_of("a"))
            assert refused.value.kind is kinds.PLANNING_BUSY
            for _ in range(MOST - MOST_OF_ONE):
                await places.enter_async_context(queue.place_of("b"))
            with pytest.raises(Problem):
                await places.enter_async_context(queue.place_of("c"))
        async with queue.place_of("a"), queue.place_of("c"):
            pass

    asyncio.run(fill())


def test_a_place_that_comes_free_is_taken_by_one_that_waits() -> None:
    async def wait() -> None:
        queue = PlanningQueue(Held())
        taken = asyncio.Event()

        async def take() -> None:
            async with queue.place_of("a"):
                taken.set()

        async with AsyncExitStack() as places:
            for _ in range(MOST_OF_ONE):
                await places.enter_async_context(queue.place_of("a"))
            waiting = asyncio.create_task(take())
            await turns()
            assert not taken.is_set()
        await waiting

    asyncio.run(wait())


def test_the_end_does_not_wait_for_what_is_computed() -> None:
    async def close() -> list[object]:
        queue = PlanningQueue(Held())

        async def ask() -> None:
            async with queue.place_of("a"):
                await queue.run(int, progress=Progress())

        asking = [asyncio.create_task(ask()) for _ in range(MOST_OF_ONE + 1)]
        await turns()
        await queue.close()
        return list(await asyncio.gather(*asking, return_exceptions=True))

    answers = asyncio.run(close())

    assert len(answers) == MOST_OF_ONE + 1
    for each in answers:
        assert isinstance(each, Problem)
        assert each.kind is kinds.SHUTTING_DOWN


def test_a_refused_request_is_answered_with_the_time_to_retry() -> None:
    refusal = problem_response(PlanningQueue(Held())._busy("a"))

    assert (refusal.status_code, refusal.headers["Retry-After"]) == (503, str(RETRY_AFTER_S))
