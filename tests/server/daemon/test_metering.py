"""What answering a request takes of the loop's time, by a clock that the application moves."""

import asyncio
import time
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from tests.server.daemon.loops import Loop
from transientcam_server.daemon._fair_queue import BURST_S, FairQueue
from transientcam_server.daemon._metering import CountingExecutor, Metered, in_turns

Application = Callable[[Any, Any, Any], Awaitable[None]]


class Served:
    """Runs an application on a real loop, with a clock of the processor that the test moves."""

    def __init__(self) -> None:
        self.time = Loop()
        self.sent: list[Any] = []
        self.turns = FairQueue(
            asyncio.get_running_loop(),
            share=lambda: 0.5,
            share_of_one=lambda: 0.5,
            spent=lambda: self.time.spent_s,
        )
        self.account = self.turns.account("client")

    async def send(self, message: Any) -> None:
        self.sent.append(message)

    async def answer(self, app: Application) -> None:
        async def receive() -> Any: ...

        await in_turns(app, lambda: self.account)({}, receive, self.send)


def parts(count: int) -> list[dict[str, Any]]:
    start = {"type": "http.response.start", "status": 200, "headers": []}
    body = {"type": "http.response.body", "body": b"x"}
    return [start, *({**body, "more_body": each < count - 1} for each in range(count))]


def test_each_step_counts_wherever_it_waits() -> None:
    async def run() -> float:
        served = Served()

        async def app(scope: Any, receive: Any, send: Any) -> None:
            for message in parts(1):
                served.time.work(0.3 * BURST_S)
                await asyncio.sleep(0)
                await send(message)
            await asyncio.gather(asyncio.sleep(0.001))

        await served.answer(app)
        assert served.sent == parts(1)
        return served.account.had_s

    assert asyncio.run(run()) == pytest.approx(0.6 * BURST_S)


def test_what_is_sent_by_a_task_of_its_own_counts_and_waits_for_its_turn() -> None:
    async def run() -> None:
        served = Served()
        cost_s = 0.6 * BURST_S

        async def send(message: Any) -> None:
            served.time.work(cost_s)
            served.sent.append(message)

        async def app(scope: Any, receive: Any, send: Any) -> None:
            async def stream() -> None:
                for message in parts(3):
                    await send(message)

            await asyncio.create_task(stream())

        served.send = send  # type: ignore[method-assign]
        begin_s = asyncio.get_running_loop().time()
        await served.answer(app)
        took_s = asyncio.get_running_loop().time() - begin_s

        assert served.sent == parts(3)
        # 4 messages; the last two had to wait until what was spent beyond the burst was there
        assert took_s >= (3 * cost_s - BURST_S) / 0.5

    asyncio.run(run())


def test_what_a_request_does_on_another_thread_counts() -> None:
    async def run() -> float:
        served = Served()
        asyncio.get_running_loop().set_default_executor(CountingExecutor(1))

        async def app(scope: Any, receive: Any, send: Any) -> None:
            assert await asyncio.to_thread(_spend, 0.02) == "done"
            with pytest.raises(LookupError):
                await asyncio.to_thread(_spend_in_vain, 0.02)
            await asyncio.sleep(0)

        before_s = served.account.left_s
        await asyncio.create_task(served.answer(app))  # in a context of its own
        await asyncio.to_thread(_spend, 0.02)  # for no request
        return before_s - served.account.left_s

    assert 0.04 <= asyncio.run(run()) < 0.06


def _spend(duration_s: float) -> str:
    end_s = time.thread_time() + duration_s
    while time.thread_time() < end_s:
        pass
    return "done"


def _spend_in_vain(duration_s: float) -> None:
    _spend(duration_s)
    raise LookupError


def test_errors_and_cancellation_reach_the_application() -> None:
    async def run() -> list[str]:
        served = Served()
        seen: list[str] = []

        async def app(scope: Any, receive: Any, send: Any) -> None:
            try:
                await asyncio.sleep(3600.0)
            except asyncio.CancelledError:
                seen.append("cancelled")
                raise

        task = asyncio.create_task(served.answer(app))
        await asyncio.sleep(0)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

        async def failing(scope: Any, receive: Any, send: Any) -> None:
            try:
                async with asyncio.timeout(0.0):
                    await asyncio.sleep(3600.0)
            except TimeoutError:
                seen.append("late")
            raise LookupError

        with pytest.raises(LookupError):
            await served.answer(failing)
        return seen

    assert asyncio.run(run()) == ["cancelled", "late"]


def test_an_application_that_is_given_up_ends() -> None:
    ended = []

    async def app() -> None:
        try:
            await asyncio.get_running_loop().create_future()
        finally:
            ended.append(True)

    async def run() -> None:
        served = Served()
        awaited = Metered(app(), served.account).__await__()
        next(awaited)
        awaited.close()

    asyncio.run(run())
    assert ended == [True]
