"""Turns by clocks that the test moves: so much in all, and as much for each address."""

from collections.abc import Callable
from functools import partial
from typing import Any, cast

import pytest

from tests.server.daemon.loops import SHARE, STEP_S, Client, Loop
from transientcam_server.daemon._fair_queue import (
    BURST_OF_ONE_S,
    BURST_S,
    HELD_SHARE,
    HOLD_S,
    MOST_DEBT_S,
    MOST_LEAD_S,
    SLICE_S,
    FairQueue,
)


def test_all_together_have_their_share_of_the_time() -> None:
    loop = Loop()
    turns = loop.turns()
    for name in ("a", "b", "c"):
        Client(loop, turns.account(name)).ask(16)
    for _ in range(1000):
        loop.pass_s(0.001)

    allowed_s = BURST_S + SHARE * loop.now_s
    assert allowed_s - 2 * STEP_S <= loop.spent_s <= allowed_s + STEP_S


def test_an_address_has_no_more_for_having_more_connections_or_dearer_requests() -> None:
    loop = Loop()
    turns = loop.turns()
    many = Client(loop, turns.account("many"), costs_s=4 * STEP_S)
    one = Client(loop, turns.account("one"))
    many.ask(64)
    one.ask()
    for _ in range(1000):
        loop.pass_s(0.001)

    assert one.had * STEP_S == pytest.approx(many.had * 4 * STEP_S, rel=0.05)


def test_one_address_has_its_own_share_though_no_other_asks() -> None:
    loop = Loop()
    turns = loop.turns(share_of_one=SHARE / 3)
    Client(loop, turns.account("one")).ask(16)
    for _ in range(3000):
        loop.pass_s(0.001)

    allowed_s = BURST_OF_ONE_S + SHARE / 3 * loop.now_s
    assert allowed_s - 2 * STEP_S <= loop.spent_s <= allowed_s + STEP_S


def test_addresses_that_have_had_their_own_share_hold_no_other_back() -> None:
    loop = Loop()
    turns = loop.turns(share_of_one=SHARE / 3)
    Client(loop, turns.account("one")).ask(16)
    loop.pass_s(0.01)
    while loop.spent_s < BURST_OF_ONE_S:
        loop.pass_s(0.001)
    asked_s = loop.now_s
    answered: list[float] = []
    turns.account("another").run(partial(_note, answered, loop))
    while not answered:
        loop.pass_s(0.0001)

    assert answered[0] - asked_s <= 2 * STEP_S / SHARE


def test_what_other_threads_spend_for_an_address_counts_against_its_share_alone() -> None:
    loop = Loop()
    turns = loop.turns(share_of_one=SHARE / 3)
    account, another = turns.account("a"), turns.account("another")
    account.charge(BURST_OF_ONE_S + STEP_S)
    answered: list[float] = []

    assert another.run(_nothing)
    assert not account.run(partial(_note, answered, loop))
    loop.pass_s(STEP_S / (SHARE / 3) - 1e-6)
    assert not answered
    loop.pass_s(0.002)
    assert answered


def test_an_address_saves_up_no_more_than_a_burst() -> None:
    loop = Loop()
    turns = loop.turns(share_of_one=SHARE / 3)
    client = Client(loop, turns.account("one"))
    loop.pass_s(3600.0)
    begin_s = loop.now_s
    client.ask(16)
    for _ in range(1000):
        loop.pass_s(0.001)

    assert loop.spent_s <= BURST_OF_ONE_S + SHARE / 3 * (loop.now_s - begin_s) + STEP_S


def test_an_occasional_address_waits_for_one_turn_of_each_other_address_at_most() -> None:
    loop = Loop()
    turns = loop.turns()
    for address in range(16):
        Client(loop, turns.account(f"flooding {address}")).ask(16)
    loop.pass_s(1.0)

    waits_s = []
    for _ in range(20):
        loop.pass_s(0.1)
        asked_s = loop.now_s
        answered: list[float] = []
        turns.account("healthy").run(partial(_note, answered, loop))
        while not answered:
            loop.pass_s(0.0005)
        waits_s.append(answered[0] - asked_s)

    assert max(waits_s) <= 17 * STEP_S / SHARE + 0.002  # of them each has 16 that wait


def _note(answered: list[float], loop: Loop) -> None:
    answered.append(loop.now_s)


def test_the_rest_of_the_loop_has_its_turn_between() -> None:
    loop = Loop()
    account = loop.turns().account("a")
    at: list[float] = []

    def step() -> None:
        loop.work(STEP_S)
        at.append(loop.spent_s)

    for _ in range(10):
        account.run(step)
    before_s = loop.spent_s
    loop.turn()

    assert before_s <= SLICE_S + STEP_S
    assert loop.spent_s - before_s <= SLICE_S + STEP_S
    loop.pass_s(0.1)
    assert len(at) == 10


def test_a_single_step_that_took_long_delays_no_address_for_long() -> None:
    loop = Loop()
    turns = loop.turns()
    heavy, light = turns.account("heavy"), turns.account("light")
    heavy.run(lambda: loop.work(30.0))
    answered: list[float] = []
    light.run(partial(_note, answered, loop))
    heavy.run(partial(_note, answered, loop))
    loop.pass_s((MOST_DEBT_S + 0.001) / SHARE)

    assert len(answered) == 2


def test_what_an_address_had_is_held_against_it_for_so_long_and_no_longer() -> None:
    loop = Loop()
    turns = loop.turns()
    first, second = turns.account("first"), turns.account("second")
    for _ in range(5):
        first.count(lambda: loop.work(1.0))
    ahead = Client(loop, first)
    behind = Client(loop, second)
    ahead.ask()
    behind.ask()
    begin_s = loop.spent_s
    while not ahead.had:
        loop.pass_s(0.01)

    assert loop.spent_s - begin_s <= MOST_LEAD_S + 3 * STEP_S


def test_a_step_within_a_step_counts_once() -> None:
    loop = Loop()
    account = loop.turns().account("a")

    def outer() -> None:
        account.count(lambda: loop.work(0.004))
        loop.work(0.004)

    account.run(outer)
    done: list[float] = []
    loop.turn()
    account.run(partial(_note, done, loop))

    assert done  # 8 ms of the 10 that may be spent at once


def test_accounts_of_addresses_that_are_gone_are_forgotten() -> None:
    loop = Loop()
    turns = loop.turns()
    first = turns.account("0")
    for number in range(5000):
        account = turns.account(str(number))
        account.run(_nothing)
        loop.pass_s(0.001)

    assert turns.account("0") is not first


def _nothing() -> None: ...


@pytest.mark.parametrize("fail", [ValueError, StopIteration])
def test_a_step_that_fails_counts_too(fail: type[Exception]) -> None:
    loop = Loop()
    account = loop.turns().account("a")

    def failing() -> None:
        loop.work(MOST_DEBT_S)
        raise fail

    with pytest.raises(fail):
        account.count(failing)
    work: Callable[[], None] = _nothing
    assert not account.run(work)


def test_while_another_queue_goes_first_nothing_is_begun_until_that_is_done_or_takes_long() -> None:
    loop = Loop()
    others = loop.turns()
    first = FairQueue(
        cast("Any", loop),
        share=lambda: SHARE,
        share_of_one=lambda: SHARE,
        clock=lambda: loop.now_s,
        spent=lambda: loop.spent_s,
        goes_before=(others,),
    )
    done: list[str] = []
    for hold_s in (HOLD_S, 0.0):
        one = first.account("one")
        one.run(partial(done.append, "first"))
        others.account("one").run(partial(done.append, "other"))
        assert done == ["first"]
        if not hold_s:
            one.done()
        loop.pass_s(hold_s)
        loop.pass_s(0.002)
        assert done == ["first", "other"]
        done.clear()
        loop.pass_s(HOLD_S / HELD_SHARE)


def test_one_that_goes_first_all_the_time_leaves_most_of_it_to_others() -> None:
    loop = Loop()
    others = loop.turns()
    client = Client(loop, others.account("one"))
    client.ask(16)
    for _ in range(5000):
        others.hold()
        loop.pass_s(0.001)

    allowed_s = SHARE * loop.now_s
    assert loop.spent_s >= 0.95 * (1.0 - HELD_SHARE) * allowed_s
    assert loop.spent_s < allowed_s


def test_a_request_that_was_begun_is_done_before_another_one_is() -> None:
    loop = Loop()
    account = loop.turns().account("one")
    begun: list[int] = []

    def begin(number: int) -> None:
        begun.append(number)
        account.begun()

    for number in range(3):
        account.run(partial(begin, number))
    for turns in range(1, 4):
        assert begun == list(range(turns))
        loop.turn()
