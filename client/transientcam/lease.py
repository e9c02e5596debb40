"""Being alone in control of a camera, for the length of a block."""

import asyncio
import threading
from collections.abc import Awaitable, Callable
from types import TracebackType
from typing import Any, Final, Literal

from transientcam.errors import ProblemError, TransientcamError
from transientcam.requests import request

OnLapse = Literal["stop", "keep"]
_RENEWALS: Final = 3.0
"""How often a lease is renewed in its duration, so that one renewal may fail."""
_LOST: Final = "/problems/lease-lost"


class Lease:
    """The lease of a camera, renewed on a thread of its own until its block ends.

    Made by `Camera.lease`. Changes made through that camera are made under it.

    Attributes
    ----------
    holder
        What others are told.
    """

    def __init__(
        self,
        ask: Callable[[request.Request[dict[str, Any]]], dict[str, Any]],
        show: Callable[[str | None], None],
        terms: dict[str, Any],
    ) -> None:
        self._ask = ask
        self._show = show
        self._terms = terms
        self.holder: str = terms["holder"]
        self._end = threading.Event()
        self._lost: ProblemError | None = None
        self._thread: threading.Thread | None = None

    @property
    def lost(self) -> bool:
        """Whether it was taken over, or could not be renewed in time."""
        return self._lost is not None

    def __enter__(self) -> "Lease":
        granted = self._ask(request.take_lease(self._terms))
        self._show(request.lease_id(granted))
        self._end.clear()
        self._lost = None
        self._thread = threading.Thread(target=self._keep, name="transientcam-lease", daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._end.set()
        if self._thread is not None:
            self._thread.join()
        try:
            if not self.lost:
                self._ask(request.give_lease_back())
        except TransientcamError:
            # an error on the way says more, and what cannot be given back lapses
            if error is None:
                raise
        finally:
            self._show(None)

    def _keep(self) -> None:
        while not self._end.wait(self._terms["duration_s"] / _RENEWALS):
            try:
                self._ask(request.renew_lease())
            except ProblemError as problem:
                if problem.type == _LOST:
                    self._lost = problem
                    return
            except TransientcamError:
                pass  # the next renewal may come through; if none does, the camera stops


class AsyncLease:
    """The lease of a camera, renewed by a task until its block ends; the twin of `Lease`."""

    def __init__(
        self,
        ask: Callable[[request.Request[dict[str, Any]]], Awaitable[dict[str, Any]]],
        show: Callable[[str | None], None],
        terms: dict[str, Any],
    ) -> None:
        self._ask = ask
        self._show = show
        self._terms = terms
        self.holder: str = terms["holder"]
        self._lost: ProblemError | None = None
        self._task: asyncio.Task[None] | None = None

    @property
    def lost(self) -> bool:
        """Whether it was taken over, or could not be renewed in time."""
        return self._lost is not None

    async def __aenter__(self) -> "AsyncLease":
        granted = await self._ask(request.take_lease(self._terms))
        self._show(request.lease_id(granted))
        self._lost = None
        self._task = asyncio.create_task(self._keep(), name="transientcam-lease")
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        try:
            if not self.lost:
                await self._ask(request.give_lease_back())
        except TransientcamError:
            if error is None:  # as above
                raise
        finally:
            self._show(None)

    async def _keep(self) -> None:
        while not self.lost:
            await asyncio.sleep(self._terms["duration_s"] / _RENEWALS)
            try:
                await self._ask(request.renew_lease())
            except ProblemError as problem:
                if problem.type == _LOST:
                    self._lost = problem
            except TransientcamError:
                pass  # as above
