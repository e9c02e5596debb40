"""An answer that takes a while to find out, found once for all who wait for it."""

import asyncio
from collections.abc import Callable
from typing import Generic, TypeVar

_Answer = TypeVar("_Answer")


class SharedAnswer(Generic[_Answer]):
    """Requests that come while one is being answered get that answer.

    ``find``: runs on another thread, one at a time.
    """

    def __init__(self, find: Callable[[], _Answer]) -> None:
        self._find = find
        self._finding: asyncio.Task[_Answer] | None = None

    async def get(self) -> _Answer:
        """Return the answer; raises what finding it raises."""
        if self._finding is None:
            self._finding = asyncio.create_task(asyncio.to_thread(self._find))
            self._finding.add_done_callback(self._found)
        return await asyncio.shield(self._finding)  # others wait for it, too

    def _found(self, _: object) -> None:
        self._finding = None
