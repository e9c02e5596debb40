"""Plans wait for one another, few at a time, and rest where frames are watched."""

import asyncio
from concurrent.futures import Executor, Future
from contextlib import AsyncExitStack
from typing import Any

import pytest

from transientcam_server.api.problems import problem_response
from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging.workers import Workers
from transientcam_server.planning.queue import (
    MOST,
    MOST_OF_ONE,
    RETRY_AFTER_S,
    Allowance,
    PlanningQueue,
    Rest,
)


class Held(Executor):
    """Runs nothing: the futures of what was submitted end when a test says so."""

    def __init__(self) -> None:
        self.submitted: list[Future[Any]] = []

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> "Future[Any]":
        self.submitted.append(Future())
        return self.submitted[-1]


async def turns() -> None:
    """Let the loop do all that can be done now."""
    for _ in range(20):
        await asyncio.sleep(0)


def test_one_plan_is_computed_at_a_time() -> None:
    async def three() -> None:
        held = Held()
        queue = PlanningQueue(Workers(held, count=8))
        plans = [asyncio.create_task(queue.run(int)) for _ in range(3)]
        for k, plan in enumerate(plans):
            await turns()
            assert len(held.submitted) == k + 1
            held.submitted[k].set_result((k, 0.0))
            assert await plan == k

    asyncio.run(three())


def test_a_plan_that_is_given_up_lets_the_next_one_go_on() -> None:
    async def two() -> None:
        held = Held()
        queue = PlanningQueue(Workers(held, count=8))
        first, second = (asyncio.create_task(queue.run(int)) for _ in range(2))
        await turns()
        first.cancel()
        await turns()
        assert len(held.submitted) == 2
        held.submitted[1].set_result((2, 0.0))
        assert await second == 2

    asyncio.run(two())


def test_an_address_has_few_places_and_leaves_some_to_others() -> None:
    async def fill() -> None:
        queue = PlanningQueue(Workers(Held(), count=2), wait_s=0.0)
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
        queue = PlanningQueue(Workers(Held(), count=2))
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
        queue = PlanningQueue(Workers(Held(), count=2))

        async def ask() -> None:
            async with queue.place_of("a"):
                await queue.run(int)

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
    refusal = problem_response(PlanningQueue(Workers(Held(), count=2))._busy("a"))

    assert (refusal.status_code, refusal.headers["Retry-After"]) == (503, str(RETRY_AFTER_S))


class Day:
    """Time that passes by resting and computing alone."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.computed_s = 0.0
        self.waited_s: list[float] = []

    def compute(self, cpu_s: float) -> None:
        self.now_s += cpu_s
        self.computed_s += cpu_s

    def wait(self, rest_s: float) -> None:
        self.waited_s.append(rest_s)
        self.now_s += rest_s


def test_a_plan_now_and_then_does_not_rest_and_many_keep_to_the_share() -> None:
    day, share = Day(), 0.25
    allowance = Allowance(lambda: share, at_once_s=10.0, now_s=lambda: day.now_s)
    rest = Rest(allowance, day.wait, cpu_s=lambda: day.computed_s)

    day.compute(10.0)
    rest()
    assert day.waited_s == []

    begin_s, before_s = day.now_s, day.computed_s
    for _ in range(200):
        day.compute(0.5)
        rest()
    # the tenth that came back while the first ten seconds were computed is spent, too
    taken = (day.computed_s - before_s - 2.5) / (day.now_s - begin_s)
    assert taken == pytest.approx(share, rel=1e-6)

    day.now_s += 40.0  # the allowance is back
    rested = len(day.waited_s)
    day.compute(10.0)
    rest()
    assert len(day.waited_s) == rested


def test_nothing_rests_without_viewers_and_no_debt_is_left_behind() -> None:
    day, share = Day(), 1.0
    allowance = Allowance(lambda: share, at_once_s=0.0, now_s=lambda: day.now_s)
    rest = Rest(allowance, day.wait, cpu_s=lambda: day.computed_s)

    day.computed_s += 100.0  # on several processors, or with a clock that stands
    rest()
    share = 0.25
    day.compute(0.1)
    rest()
    assert day.waited_s == pytest.approx([0.3])
