"""Answers that take a while: found once for all who wait, and anew for those who come later."""

import asyncio
import threading

import pytest

from transientcam_server.api._shared_answer import SharedAnswer


def test_requests_that_come_meanwhile_get_the_same_answer() -> None:
    go_on, found = threading.Event(), list[int]()

    def find() -> int:
        go_on.wait(60.0)
        found.append(len(found))
        return found[-1]

    async def ask() -> tuple[list[int], int]:
        shared = SharedAnswer(find)
        waiting = [asyncio.create_task(shared.get()) for _ in range(50)]
        await asyncio.sleep(0)
        waiting.pop().cancel()  # who goes takes nobody's answer away
        go_on.set()
        return await asyncio.gather(*waiting), await shared.get()

    together, later = asyncio.run(ask())

    assert set(together) == {0}
    assert later == 1


def test_one_that_fails_is_tried_again() -> None:
    failures = [OSError("no network")]

    def find() -> int:
        if failures:
            raise failures.pop()
        return 3

    async def ask() -> int:
        shared = SharedAnswer(find)
        with pytest.raises(OSError, match="no network"):
            await shared.get()
        return await shared.get()

    assert asyncio.run(ask()) == 3
