"""Exclusive control of a camera for the length of a block."""

import asyncio
import threading
from collections.abc import Awaitable, Callable
from typing import Any, Final, Literal

from transientcam.errors import ProblemError, ProtocolError, TransientcamError
from transientcam.requests import Request, document

OnLapse = Literal["stop", "keep"]
_RENEWALS: Final = 3.0
"""How often a lease is renewed in its duration, so that one renewal may fail."""
_LOST: Final = "/problems/lease-lost"
_RENEW: Final = document("lease", method="PUT", body={})
GIVE_BACK: Final = document("lease", method="DELETE")


class BaseLease:
    """What `Lease` and `AsyncLease` have in common.

    ``holder``: name shown to other clients.
    ``id``: the secret that changes under it carry; empty before it was granted.
    """

    def __init__(self, show: Callable[[str | None], None], terms: dict[str, Any]) -> None:
        self._show = show
        self._take = document("lease", method="POST", body=terms)
        self._renewed_every_s = terms["duration_s"] / _RENEWALS
        self._lost: ProblemError | None = None
        self.holder: str = terms["holder"]
        self.id = ""

    @property
    def lost(self) -> bool:
        """Whether it was taken over, or could not be renewed in time."""
        return self._lost is not None

    def _begin(self, granted: dict[str, Any]) -> None:
        value = granted.get("lease_id")
        if not isinstance(value, str):
            raise ProtocolError("lease_id", value, "a string")
        self.id = value
        self._show(self.id)
        self._lost = None

    def _renewal_failed(self, error: TransientcamError) -> None:
        # after any other error the next renewal may succeed; if none does, the camera stops
        if isinstance(error, ProblemError) and error.type == _LOST:
            self._lost = error


class Lease(BaseLease):
    """The lease of a camera, renewed on a thread of its own until its block ends.

    Made by `Camera.lease`. Changes made through that camera are made under it.
    """

    def __init__(
        self,
        ask: Callable[[Request[dict[str, Any]]], dict[str, Any]],
        show: Callable[[str | None], None],
        terms: dict[str, Any],
    ) -> None:
        super().__init__(show, terms)
        self._ask = ask
        self._end = threading.Event()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> "Lease":
        self._begin(self._ask(self._take))
        self._end.clear()
        self._thread = threading.Thread(target=self._keep, name="transientcam-lease", daemon=True)
        self._thread.start()
        return self

    def abandon(self) -> None:
        """Renew it no more, and make changes without it; it is not given back here."""
        self._end.set()
        self._show(None)

    def __exit__(self, _kind: object, error: object, _traceback: object) -> None:
        self._end.set()
        if self._thread is not None:
            self._thread.join()
        try:
            if not self.lost:
                self._ask(GIVE_BACK)
        except TransientcamError:
            # an error of the block says more, and a lease that is not given back lapses
            if error is None:
                raise
        finally:
            self._show(None)

    def _keep(self) -> None:
        while not self.lost and not self._end.wait(self._renewed_every_s):
            try:
                self._ask(_RENEW)
            except TransientcamError as error:
                self._renewal_failed(error)


class AsyncLease(BaseLease):
    """The lease of a camera, renewed by a task until its block ends; the twin of `Lease`."""

    def __init__(
        self,
        ask: Callable[[Request[dict[str, Any]]], Awaitable[dict[str, Any]]],
        show: Callable[[str | None], None],
        terms: dict[str, Any],
    ) -> None:
        super().__init__(show, terms)
        self._ask = ask
        self._task: asyncio.Task[None] | None = None

    async def __aenter__(self) -> "AsyncLease":
        self._begin(await self._ask(self._take))
        self._task = asyncio.create_task(self._keep(), name="transientcam-lease")
        return self

    async def __aexit__(self, _kind: object, error: object, _traceback: object) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        try:
            if not self.lost:
                await self._ask(GIVE_BACK)
        except TransientcamError:
            if error is None:  # as above
                raise
        finally:
            self._show(None)

    async def _keep(self) -> None:
        while not self.lost:
            await asyncio.sleep(self._renewed_every_s)
            try:
                await self._ask(_RENEW)
            except TransientcamError as error:
                self._renewal_failed(error)
