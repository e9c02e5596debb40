"""Shares the time of the event loop between clients, by address.

What clients ask for has so much of the loop's processor time and no more, so that frames are made
and sent beside it whatever is asked, and one address has less of it. Where it is not enough for
all, each address has as much as any other (start-time fair queueing: Goyal, Vin & Cheng 1996), and
its connections take turns.
"""

import asyncio
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Final, TypeVar

BURST_S: Final = 0.01
"""Processor time that may be spent at once where little was spent before."""
BURST_OF_ONE_S: Final = 0.1
"""The same, by one address: what it takes to open a dashboard."""
SLICE_S: Final = 0.001
"""Processor time after which the rest of the loop has its turn."""
MOST_DEBT_S: Final = 0.1
"""What a single step took beyond this is not counted: no client waits long because of it."""
MOST_LEAD_S: Final = 1.0
"""The same, of what one address has had before the others."""
HOLD_S: Final = 0.5
"""Time at most in which nothing else is begun while what goes first is under way."""
HELD_SHARE: Final = 0.5
"""Of the time, in the long run: what goes first may come again and again."""
_LEAST_PAUSE_S: Final = 0.001
_REMEMBERED: Final = 1024
_T = TypeVar("_T")


class Account:
    """What one address has of the loop's time; `FairQueue.account` makes it."""

    def __init__(self, turns: "FairQueue") -> None:
        self.had_s = 0.0
        self.left_s = BURST_OF_ONE_S
        self.counted_s = 0.0
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

    def charge(self, spent_s: float) -> None:
        """Count processor time that another thread has spent for it."""
        self.left_s = max(-MOST_DEBT_S, self.left_s - spent_s)

    def begun(self) -> None:
        """Note that a request was begun: it takes its time in the next turn of the loop.

        Nothing more is begun in this one, or many would be done in one go, and all else wait.
        """
        self._turns.end_slice()

    def done(self) -> None:
        """Note that what was under way is done."""
        self._turns.release_others()

    async def turn(self) -> None:
        """Wait until there is time."""
        come = asyncio.get_running_loop().create_future()
        self.run(lambda: None if come.done() else come.set_result(None))
        await come


class FairQueue:
    """Shares a part of the time of an event loop between those who ask for it.

    ``share``: how much of its thread's processor time there is to share now, in the long run.
    ``share_of_one``: how much of it one address may have.
    ``clock``, ``spent``: real time, and processor time of this thread, in s.
    ``goes_before``: queues of the same loop that begin nothing while one of this is under way.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        *,
        share: Callable[[], float],
        share_of_one: Callable[[], float],
        clock: Callable[[], float] = time.monotonic,
        spent: Callable[[], float] = time.thread_time,
        goes_before: Sequence["FairQueue"] = (),
    ) -> None:
        self._loop = loop
        self._share = share
        self._share_of_one = share_of_one
        self._clock = clock
        self._spent = spent
        self._goes_before = goes_before
        self._held_s = self._held_until_s = self._next_hold_s = clock()
        self._accounts: dict[str, Account] = {}
        self._waiting: dict[Account, None] = {}
        self._now_s = 0.0
        self._left_s = BURST_S
        self._slice_s = SLICE_S
        self._counted_s = clock()
        self._counting = False
        self._later: asyncio.Handle | None = None
        self._due_s = 0.0

    def account(self, address: str) -> Account:
        """Return the account of an address."""
        found = self._accounts.get(address)
        if found is None:
            if len(self._accounts) >= _REMEMBERED:
                self._accounts = {
                    key: each for key, each in self._accounts.items() if self._is_remembered(each)
                }
            found = self._accounts[address] = Account(self)
            found.counted_s = self._clock()
        return found

    def run(self, account: Account, work: Callable[[], None]) -> bool:
        """Do as `Account.run` says."""
        self.hold_others()
        if (
            not self._waiting
            and self._slice_s > 0.0
            and self._has_time()
            and self._has_time_for(account)
        ):
            self._now_s = max(self._now_s, account.had_s)  # none waits, so none had more
            self.count(account, work)
            self._serve_within(0.0)
            return True
        account.waiting.append(work)
        if account not in self._waiting:
            account.had_s = max(account.had_s, self._now_s)
            self._waiting[account] = None
        self._go_on_later()
        return False

    def end_slice(self) -> None:
        """Let the rest of the loop have its turn before more is begun."""
        self._slice_s = 0.0

    def hold_others(self) -> None:
        """Let the queues that this one goes before begin nothing for a while, not all the time."""
        for each in self._goes_before:
            each.hold()

    def release_others(self) -> None:
        """Let them go on."""
        for each in self._goes_before:
            each.release()

    def hold(self) -> None:
        """Begin nothing until `release`, for `HOLD_S` at most, unless that was so a moment ago."""
        now_s = self._clock()
        if now_s >= self._next_hold_s:
            self._held_s, self._held_until_s = now_s, now_s + HOLD_S
            self._next_hold_s = now_s + HOLD_S / HELD_SHARE

    def release(self) -> None:
        """Go on."""
        now_s = self._clock()
        if now_s < self._held_until_s:
            self._held_until_s = now_s
            self._next_hold_s = self._held_s + (now_s - self._held_s) / HELD_SHARE
            if self._waiting:
                self._serve_within(0.0)

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
        account.charge(spent_s)
        self._left_s = max(-MOST_DEBT_S, self._left_s - spent_s)
        self._slice_s -= spent_s
        begun_s = max(account.had_s, self._now_s)
        account.had_s = min(begun_s + spent_s, self._now_s + MOST_LEAD_S)

    def _serve(self) -> None:
        self._later = None
        self._slice_s = SLICE_S
        while self._slice_s > 0.0 and self._has_time():
            ready = [each for each in self._waiting if self._has_time_for(each)]
            if not ready:
                break
            account = min(ready, key=lambda each: each.had_s)
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
        return self._left_s > 0.0 and now_s >= self._held_until_s

    def _has_time_for(self, account: Account) -> bool:
        now_s = self._clock()
        earned_s = self._share_of_one() * (now_s - account.counted_s)
        account.left_s = min(BURST_OF_ONE_S, account.left_s + earned_s)
        account.counted_s = now_s
        return account.left_s > 0.0

    def _is_remembered(self, account: Account) -> bool:
        """Whether an address would have more as a new one."""
        self._has_time_for(account)
        had = account.had_s > self._now_s or account.left_s < BURST_OF_ONE_S
        return had or bool(account.waiting)

    def _go_on_later(self) -> None:
        pauses_s = [0.0]
        if not self._has_time():
            held_s = self._held_until_s - self._clock()
            pauses_s += [_LEAST_PAUSE_S, -self._left_s / self._share(), held_s]
        if not any(map(self._has_time_for, self._waiting)):
            least_debt_s = min(-each.left_s for each in self._waiting)
            pauses_s += [_LEAST_PAUSE_S, least_debt_s / self._share_of_one()]
        self._serve_within(max(pauses_s))

    def _serve_within(self, pause_s: float) -> None:
        due_s = self._clock() + pause_s
        if self._later is not None:
            if self._due_s <= due_s:
                return
            self._later.cancel()
        self._due_s = due_s
        self._later = (
            self._loop.call_later(pause_s, self._serve)
            if pause_s
            else self._loop.call_soon(self._serve)
        )
