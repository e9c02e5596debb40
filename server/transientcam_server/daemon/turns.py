"""Shares the time of the event loop between clients, by address.

What clients ask for has so much of the loop's processor time and no more, so that frames are made
and sent beside it whatever is asked. Where it is not enough for all, each address has as much as
any other (start-time fair queueing: Goyal, Vin & Cheng 1996), and its connections take turns.
"""

import asyncio
import time
from collections import deque
from collections.abc import Callable
from typing import Final, TypeVar

BURST_S: Final = 0.01
"""Processor time that may be spent at once where little was spent before."""
SLICE_S: Final = 0.001
"""Processor time after which the rest of the loop has its turn."""
MOST_DEBT_S: Final = 0.1
"""What a single step took beyond this is not counted: no client waits long because of it."""
MOST_LEAD_S: Final = 1.0
"""The same, of what one address has had before the others."""
_LEAST_PAUSE_S: Final = 0.001
_REMEMBERED: Final = 1024
_T = TypeVar("_T")


class Account:
    """What one address has of the loop's time; `Turns.account` makes it."""

    def __init__(self, turns: "Turns") -> None:
        self.had_s = 0.0
        self.waiting: deque[Callable[[], None]] = deque()
        self._turns = turns

    def run(self, work: Callable[[], None]) -> bool:
        """Run ``work`` now if there is time and no other waits, in its turn otherwise.

        Returns whether it has run.
        """
        return self._turns.run(self, work)

    def count(self, step: Callable[[], _T]) -> _T:
        """Return what a step returns, and count its processor time."""
        return self._turns.count(self, step)

    async def turn(self) -> None:
        """Wait until there is time."""
        come = asyncio.get_running_loop().create_future()
        self.run(lambda: None if come.done() else come.set_result(None))
        await come


class Turns:
    """Shares a part of the time of an event loop between those who ask for it.

    Parameters
    ----------
    loop
        Whose time is shared.
    share
        How much of its thread's processor time there is to share at present, in the long run.
    clock
        Real time in s.
    spent
        Processor time of this thread in s.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        *,
        share: Callable[[], float],
        clock: Callable[[], float] = time.monotonic,
        spent: Callable[[], float] = time.thread_time,
    ) -> None:
        self._loop = loop
        self._share = share
        self._clock = clock
        self._spent = spent
        self._accounts: dict[str, Account] = {}
        self._waiting: dict[Account, None] = {}
        self._now_s = 0.0
        self._left_s = BURST_S
        self._slice_s = SLICE_S
        self._counted_s = clock()
        self._counting = False
        self._later: asyncio.Handle | None = None

    def account(self, address: str) -> Account:
        """Return the account of an address."""
        found = self._accounts.get(address)
        if found is None:
            if len(self._accounts) >= _REMEMBERED:
                self._accounts = {
                    key: each
                    for key, each in self._accounts.items()
                    if each.waiting or each.had_s > self._now_s
                }
            found = self._accounts[address] = Account(self)
        return found

    def run(self, account: Account, work: Callable[[], None]) -> bool:
        """Do as `Account.run` says."""
        if not self._waiting and self._slice_s > 0.0 and self._has_time():
            self._now_s = max(self._now_s, account.had_s)  # none waits, so none had more
            self.count(account, work)
            if self._later is None:
                self._later = self._loop.call_soon(self._serve)
            return True
        account.waiting.append(work)
        if account not in self._waiting:
            account.had_s = max(account.had_s, self._now_s)
            self._waiting[account] = None
        self._go_on_later()
        return False

    def count(self, account: Account, step: Callable[[], _T]) -> _T:
        """Do as `Account.count` says; a step within a step is counted once."""
        if self._counting:
            return step()
        self._counting = True
        begin_s = self._spent()
        try:
            return step()
        finally:
            self._counting = False
            self._charge(account, self._spent() - begin_s)

    def _charge(self, account: Account, spent_s: float) -> None:
        self._left_s = max(-MOST_DEBT_S, self._left_s - spent_s)
        self._slice_s -= spent_s
        begun_s = max(account.had_s, self._now_s)
        account.had_s = min(begun_s + spent_s, self._now_s + MOST_LEAD_S)

    def _serve(self) -> None:
        self._later = None
        self._slice_s = SLICE_S
        while self._waiting and self._slice_s > 0.0 and self._has_time():
            account = min(self._waiting, key=lambda each: each.had_s)
            self._now_s = account.had_s
            work = account.waiting.popleft()
            if not account.waiting:
                del self._waiting[account]
            self.count(account, work)
        if self._waiting:
            self._go_on_later()

    def _has_time(self) -> bool:
        now_s = self._clock()
        self._left_s = min(BURST_S, self._left_s + self._share() * (now_s - self._counted_s))
        self._counted_s = now_s
        return self._left_s > 0.0

    def _go_on_later(self) -> None:
        if self._later is None and self._has_time():
            self._later = self._loop.call_soon(self._serve)
        elif self._later is None:
            pause_s = max(_LEAST_PAUSE_S, -self._left_s / self._share())
            self._later = self._loop.call_later(pause_s, self._serve)
