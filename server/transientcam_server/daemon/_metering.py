"""Requests in turns: what answering one takes of the processor's time is counted."""

import asyncio
import contextlib
import time
from collections.abc import Awaitable, Callable, Coroutine, Generator
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import ContextVar
from functools import partial
from typing import Any, Final, TypeVar

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from transientcam_server.daemon._fair_queue import Account

_T = TypeVar("_T")
_asking: Final[ContextVar[Account | None]] = ContextVar("asking", default=None)
"""For which account this runs."""


class Metered:
    """Awaits a coroutine, and counts the processor time of each of its steps."""

    def __init__(self, coroutine: Any, account: Account) -> None:
        self._coroutine = coroutine
        self._account = account

    def __await__(self) -> Generator[Any, Any, Any]:
        """Do as the coroutine does (PEP 380)."""
        step: Callable[[], Any] = partial(self._coroutine.send, None)
        while True:
            try:
                awaited = self._account.count(step)
            except StopIteration as end:
                return end.value
            try:
                value = yield awaited
            except BaseException as error:
                step = partial(self._coroutine.throw, error)
            else:
                step = partial(self._coroutine.send, value)


async def metered(coroutine: Coroutine[Any, Any, _T], account: Account) -> _T:
    """Return what a coroutine returns, with the processor time of its steps counted."""
    result: _T = await Metered(coroutine, account)
    return result


def in_turns(app: ASGIApp, account_of_request: Callable[[], Account]) -> ASGIApp:
    """Return an application whose work counts, and whose long answers wait for their turns.

    ``account_of_request`` is asked when a request begins.
    """

    async def counted(scope: Scope, receive: Receive, send: Send) -> None:
        begun, account = False, account_of_request()
        _asking.set(account)  # the server runs each request in a context of its own

        async def send_in_turn(message: Message) -> None:
            nonlocal begun
            if begun:
                await account.turn()
            begun = message["type"] == "http.response.body"
            await Metered(_sent(send, message), account)  # it may be a task of its own

        await Metered(app(scope, receive, send_in_turn), account)

    return counted


class CountingExecutor(ThreadPoolExecutor):
    """Runs what requests do on other threads, and counts that for the address that asked."""

    def submit(self, fn: Callable[..., _T], /, *arguments: Any, **keywords: Any) -> Future[_T]:
        """Run a function; called on the event loop."""
        return super().submit(counted(partial(fn, *arguments, **keywords)))


def counted(work: Callable[[], _T]) -> Callable[[], _T]:
    """Return work for another thread that counts for the address that asks; call it on the loop."""
    account = _asking.get()
    if account is None:
        return work
    loop = asyncio.get_running_loop()

    def counting() -> _T:
        begin_s = time.thread_time()
        try:
            return work()
        finally:
            with contextlib.suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(account.charge, time.thread_time() - begin_s)

    return counting


async def _sent(send: Callable[[Message], Awaitable[None]], message: Message) -> None:
    await send(message)
