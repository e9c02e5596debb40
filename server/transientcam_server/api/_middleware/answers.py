"""A budget of the bytes that are on their way to clients: slow readers do not fill the memory."""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from transientcam_server.api._problems import problem_response
from transientcam_server.errors import Problem, kinds
from transientcam_server.settings import LimitSettings

PART_BYTES: Final = 256 * 1024
"""Handed to the connection at once: the next part follows when it has taken this one."""
FREE_BYTES: Final = 64 * 1024
"""Answers in parts of no more than this are not counted."""
_KEPT_PARTS: Final = 4
_ANSWER: Final = "transientcam.answer"


class AnswerBudget:
    """Counts bytes of answers from when they are computed until their connections take them.

    An answer in parts counts as several of them: one is on its way, one is being computed, and what
    it is computed from is kept.
    """

    def __init__(self, limits: LimitSettings) -> None:
        self._limits = limits
        self._of_client: Counter[str] = Counter()

    @property
    def total_bytes(self) -> int:
        """On their way now, to all clients."""
        return self._of_client.total()

    @contextmanager
    def reserved(self, client: str, size_bytes: int) -> Iterator[None]:
        """Count an answer until the block ends.

        A client that waits for nothing else may have one answer of any size, where there is room.
        Raises Problem ``too-many-answers`` where there is no room for it.
        """
        most, most_of_one = self._limits.answers_bytes, self._limits.answers_bytes_per_address
        theirs, total = self._of_client[client], self.total_bytes
        if theirs and theirs + size_bytes > most_of_one:
            raise _problem(f"{theirs} bytes are on their way to {client}", most_of_one)
        if total and total + size_bytes > most:
            raise _problem(f"{total} bytes are on their way to clients", most)
        self._of_client[client] += size_bytes
        try:
            yield
        finally:
            self._of_client[client] -= size_bytes
            if not self._of_client[client]:
                del self._of_client[client]


class AnswerLimit:
    """Holds answers to an `AnswerBudget`, and sends large ones as the client takes them."""

    def __init__(self, app: ASGIApp, *, limits: LimitSettings) -> None:
        self._app = app
        self._budget = AnswerBudget(limits)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on, and count what comes back."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        client = scope.get("client")
        answer = _Answer(self._budget, send, "" if client is None else str(client[0]))
        try:
            await self._app({**scope, _ANSWER: answer}, receive, answer.send)
        except _NoRoom as refusal:
            response = problem_response(refusal.problem, instance=scope["path"])
            await response(scope, receive, send)
        finally:
            answer.end()


def expect_bytes(scope: Scope, size_bytes: int) -> None:
    """Count what will be taken for an answer before it is computed, or end the request here."""
    answer = scope.get(_ANSWER)
    if isinstance(answer, _Answer):
        answer.reserve(size_bytes)


class _NoRoom(BaseException):
    """Ends an application whose answer is refused; no handler of errors may answer instead."""

    def __init__(self, problem: Problem) -> None:
        super().__init__()
        self.problem = problem


class _Answer:
    """One answer: its begin waits until the size of its first part is known."""

    def __init__(self, budget: AnswerBudget, send: Send, client: str) -> None:
        self._budget = budget
        self._send = send
        self._client = client
        self._start: Message | None = None
        self._reserved: Any = None

    async def send(self, message: Message) -> None:
        """Take a message of the application."""
        if message["type"] == "http.response.start":
            self._start = message
            return
        if message["type"] != "http.response.body":
            await self._send(message)
            return
        body, more = message.get("body", b""), message.get("more_body", False)
        if self._start is not None:
            start, self._start = self._start, None
            if len(body) > FREE_BYTES and self._reserved is None:
                self.reserve(len(body) * (_KEPT_PARTS if more else 1))
            await self._send(start)
        await self._send_parts(message, body)

    def end(self) -> None:
        """Count it no more."""
        if self._reserved is not None:
            self._reserved.__exit__(None, None, None)
            self._reserved = None

    def reserve(self, size_bytes: int) -> None:
        """Count so much until the end."""
        reserved = self._budget.reserved(self._client, size_bytes)
        try:
            reserved.__enter__()
        except Problem as problem:
            raise _NoRoom(problem) from None
        self._reserved = reserved

    async def _send_parts(self, message: Message, body: bytes) -> None:
        rest = memoryview(body)
        while len(rest) > PART_BYTES:
            await self._send({**message, "body": rest[:PART_BYTES], "more_body": True})
            rest = rest[PART_BYTES:]
        await self._send({**message, "body": rest if len(rest) < len(body) else body})


def _problem(what: str, limit: int) -> Problem:
    return Problem(kinds.TOO_MANY_ANSWERS, f"{what}, of {limit}.", limit=limit, retry_after_s=1)
