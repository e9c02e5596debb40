"""An event loop whose clocks the test moves."""

from collections.abc import Callable
from typing import Any, cast

from transientcam_server.daemon._fair_queue import Account, FairQueue

SHARE = 0.3
STEP_S = 0.0005


class Handle:
    """Something that is to be done later."""

    def __init__(self, due_s: float, callback: Callable[[], None]) -> None:
        self.due_s = due_s
        self.callback = callback

    def cancel(self) -> None:
        self.callback = _nothing


def _nothing() -> None: ...


class Loop:
    """A loop with two clocks: real time, and the processor's."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.spent_s = 0.0
        self.due: list[Handle] = []

    def call_later(self, delay_s: float, callback: Callable[[], None]) -> Handle:
        self.due.append(Handle(self.now_s + delay_s, callback))
        return self.due[-1]

    def call_soon(self, callback: Callable[[], None]) -> Handle:
        return self.call_later(0.0, callback)

    def turn(self) -> None:
        """Do what is due, and nothing of what that schedules."""
        due = [each for each in self.due if each.due_s <= self.now_s]
        self.due = [each for each in self.due if each not in due]
        for each in due:
            each.callback()

    def pass_s(self, duration_s: float) -> None:
        """Let time pass, in which the loop turns as often as it may."""
        self.now_s += duration_s
        while any(each.due_s <= self.now_s for each in self.due):
            self.turn()

    def work(self, costs_s: float) -> None:
        """Spend processor time."""
        self.spent_s += costs_s

    def turns(self, share: float = SHARE, *, share_of_one: float | None = None) -> FairQueue:
        """Return turns by these clocks; one address may have all unless it is given less."""
        return FairQueue(
            cast("Any", self),
            share=lambda: share,
            share_of_one=lambda: share if share_of_one is None else share_of_one,
            clock=lambda: self.now_s,
            spent=lambda: self.spent_s,
        )


class Client:
    """Always has something to do, on as many connections as it likes."""

    def __init__(self, loop: Loop, account: Account, *, costs_s: float = STEP_S) -> None:
        self.had = 0
        self._loop = loop
        self._account = account
        self._costs_s = costs_s

    def ask(self, connections: int = 1) -> None:
        for _ in range(connections):
            self._account.run(self._have)

    def _have(self) -> None:
        self.had += 1
        self._loop.work(self._costs_s)
        self._loop.call_soon(self.ask)  # the next one, as soon as this is done
