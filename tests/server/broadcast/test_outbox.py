import asyncio
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, strategies as st

from tests.server.broadcast.outboxes import lost, numbers, run, subscribed, waiting
from tests.server.fakes import NOTICE, channel, fake_frame
from transientcam import wire
from transientcam_server.broadcast import Close, Delivery, Item, Outbox
from transientcam_server.imaging import Crop, Frame


def test_the_newest_frames_wait_and_the_dropped_ones_are_counted() -> None:
    def test() -> None:
        outbox = subscribed(depth=2)
        for number in range(1, 6):
            outbox.put_frame(fake_frame(number))

        found = waiting(outbox)
        assert numbers(found) == [4, 5]
        assert lost(found[:1]) == (3, 0)  # before the first that is sent
        assert lost(found[1:]) == (0, 0)

    run(test)


@pytest.mark.parametrize("depth", [1, 2, 3, 5])
@pytest.mark.parametrize("frames", range(9))
def test_so_many_frames_wait_as_there_is_room_for(depth: int, frames: int) -> None:
    def test() -> None:
        outbox = subscribed(depth=depth)
        dropped = [outbox.put_frame(fake_frame(number)) for number in range(frames)]

        assert dropped == [0] * min(frames, depth) + [1] * max(0, frames - depth)
        assert numbers(waiting(outbox)) == list(range(frames))[-depth:]

    run(test)


def test_nothing_is_dropped_from_a_client_that_keeps_up() -> None:
    def test() -> None:
        outbox = subscribed()
        for number in range(1, 6):
            outbox.put_frame(fake_frame(number))
            found = waiting(outbox)
            assert numbers(found) == [number]
            assert lost(found) == (0, 0)

    run(test)


def test_with_credits_only_so_many_frames_are_under_way_and_then_the_newest_follows() -> None:
    def test() -> None:
        outbox = subscribed(credit=2)
        for number in (1, 2):
            outbox.put_frame(fake_frame(number))
            assert numbers(waiting(outbox)) == [number]
        for number in (3, 4, 5):
            outbox.put_frame(fake_frame(number))
            assert waiting(outbox) == []

        outbox.acknowledge(1)

        found = waiting(outbox)
        assert numbers(found) == [5]
        assert lost(found) == (2, 2)

    run(test)


def test_what_is_dropped_while_there_is_credit_is_not_for_want_of_acknowledgements() -> None:
    def test() -> None:
        outbox = subscribed(credit=2)
        for number in (1, 2, 3):  # nothing is sent meanwhile, as while a frame is encoded
            outbox.put_frame(fake_frame(number))

        assert outbox.channels[0].dropped == 2
        assert outbox.channels[0].dropped_unacknowledged == 0

    run(test)


def test_an_acknowledgement_covers_all_frames_before_it() -> None:
    def test() -> None:
        outbox = subscribed(credit=2)
        for number in (1, 2):
            outbox.put_frame(fake_frame(number))
            waiting(outbox)
        outbox.acknowledge(2)
        for number in (3, 4):
            outbox.put_frame(fake_frame(number))
            assert numbers(waiting(outbox)) == [number]

    run(test)


def test_messages_pass_frames_that_wait_for_credit() -> None:
    def test() -> None:
        outbox = subscribed(credit=1)
        outbox.put_frame(fake_frame(1))
        waiting(outbox)
        outbox.put_frame(fake_frame(2))
        outbox.put(NOTICE)

        assert waiting(outbox) == [NOTICE]

    run(test)


def test_messages_and_frames_keep_their_order_otherwise() -> None:
    def test() -> None:
        outbox = subscribed()
        outbox.put_frame(fake_frame(1))
        outbox.put(NOTICE)
        outbox.put_frame(fake_frame(2))

        first, second, third = waiting(outbox)

        assert numbers([first, third]) == [1, 2]
        assert second == NOTICE

    run(test)


def test_a_client_that_reads_no_messages_is_closed_instead_of_filling_the_memory() -> None:
    def test() -> None:
        outbox = subscribed()
        for _ in range(64):
            outbox.put(NOTICE)
        assert len(outbox._waiting) == 64
        outbox.put(NOTICE)

        (last,) = waiting(outbox)

        assert isinstance(last, Close)
        assert last.code is wire.CloseCode.TRY_AGAIN_LATER

    run(test)


def test_a_new_subscription_forgets_the_frames_of_the_old_one() -> None:
    def test() -> None:
        outbox = subscribed()
        outbox.put_frame(fake_frame(1))
        outbox.put(NOTICE)

        outbox.subscribe((channel("direct", number=1),), credit=None)

        assert waiting(outbox) == [NOTICE]

    run(test)


@given(
    rate_hz=st.floats(0.5, 40.0), frame_rate_hz=st.floats(1.0, 60.0), frames=st.integers(50, 300)
)
def test_a_rate_limit_holds_on_average_and_never_drops(
    rate_hz: float, frame_rate_hz: float, frames: int
) -> None:
    one = channel(max_rate_hz=rate_hz)

    taken = sum(one.take(index / frame_rate_hz) for index in range(frames))

    # the first frame is always due, then one each period, or every frame where those are rarer
    duration_s = (frames - 1) / frame_rate_hz
    expected = 1.0 + duration_s * min(rate_hz, frame_rate_hz)
    assert expected - 2.0 <= taken <= expected + 1.0
    assert one.dropped == 0


@pytest.mark.parametrize("rate_hz", [1e-3, 1e-308, 5e-324])
def test_the_least_rates_leave_the_first_frame_alone(rate_hz: float) -> None:
    one = channel(max_rate_hz=rate_hz)

    assert [one.take(index / 20.0) for index in range(5)] == [True, False, False, False, False]


def test_a_rate_limit_does_not_catch_up_after_a_pause() -> None:
    one = channel(max_rate_hz=10.0)
    assert one.take(0.0)

    taken = [one.take(100.0 + index * 0.05) for index in range(5)]

    assert taken == [True, False, True, False, True]


def test_frames_not_due_for_a_slow_channel_come_for_the_others() -> None:
    def test() -> None:
        outbox = Outbox(depth=2)
        every, seldom = channel("range"), channel("direct", max_rate_hz=1.0, number=1)
        outbox.subscribe((every, seldom), credit=None)
        seen = []
        for number in range(1, 4):
            outbox.put_frame(fake_frame(number, device_time_s=number * 0.1))
            (item,) = waiting(outbox)
            assert isinstance(item, Delivery)
            seen.append([each.product.name for each in item.channels])

        assert seen == [["range", "direct"], ["range"], ["range"]]

    run(test)


def test_next_waits_until_there_is_something() -> None:
    async def test() -> None:
        outbox = subscribed()
        taking = asyncio.ensure_future(outbox.next())
        await asyncio.sleep(0)
        assert not taking.done()

        outbox.put_frame(fake_frame(1))

        assert numbers([await taking]) == [1]

    run(test)


class FakePast:
    """Frames from ``first`` to ``last`` that have passed."""

    def __init__(self, first: int | None, last: int | None) -> None:
        self.first = first
        self.last = last

    def frame(self, number: int) -> Frame:
        assert self.first is not None
        assert self.last is not None
        assert self.first <= number <= self.last
        return fake_frame(number)


def reported(items: list[Item]) -> list[dict[str, Any]]:
    return [dict(item.details) for item in items if isinstance(item, wire.Notice)]


def test_a_resuming_client_gets_every_frame_from_there_and_then_the_newest() -> None:
    def test() -> None:
        outbox, past = subscribed(), FakePast(3, 7)
        outbox.resume(past, start=5)
        assert numbers(waiting(outbox)) == [5, 6, 7]

        outbox.put_frame(fake_frame(8))
        outbox.put_frame(fake_frame(9))

        assert numbers(waiting(outbox)) == [8, 9]

    run(test)


def test_frames_that_come_while_a_client_resumes_have_their_turn_in_the_past() -> None:
    def test() -> None:
        outbox, past = subscribed(depth=1), FakePast(1, 3)
        outbox.resume(past, start=1)
        (first,) = [outbox._take()]
        for number in (4, 5, 6):
            past.last = number
            outbox.put_frame(fake_frame(number))

        assert isinstance(first, Delivery)
        found = [first, *waiting(outbox)]
        assert numbers(found) == [1, 2, 3, 4, 5, 6]
        assert lost(found) == (0, 0)

    run(test)


def test_what_the_past_loses_meanwhile_is_reported_as_a_gap_in_its_place() -> None:
    def test() -> None:
        outbox, past = subscribed(), FakePast(1, 9)
        outbox.resume(past, start=1)
        first = outbox._take()
        past.first = 5

        items = waiting(outbox)

        assert first is not None
        assert numbers([first]) == [1]
        assert reported(items[:1]) == [{"from": 2, "to": 4, "reason": "not kept any more"}]
        assert numbers(items[1:]) == [5, 6, 7, 8, 9]

    run(test)


@pytest.mark.parametrize("last", [None, 4])
def test_a_start_in_the_future_is_reported_and_not_waited_for(last: int | None) -> None:
    def test() -> None:
        outbox = subscribed()
        outbox.resume(FakePast(last, last), start=100)
        outbox.put_frame(fake_frame(5))

        gap, delivery = waiting(outbox)

        assert reported([gap]) == [
            {"from": (last or 0) + 1, "to": 99, "reason": "not captured yet"}
        ]
        assert numbers([delivery]) == [5]

    run(test)


def test_the_next_frame_is_no_gap() -> None:
    def test() -> None:
        outbox = subscribed()
        outbox.resume(FakePast(1, 4), start=5)
        outbox.put_frame(fake_frame(5))

        assert numbers(waiting(outbox)) == [5]

    run(test)


@pytest.mark.parametrize(("first", "last"), [(None, None), (None, 4), (3, None)])
def test_of_a_past_that_was_emptied_nothing_is_waited_for(
    first: int | None, last: int | None
) -> None:
    def test() -> None:
        outbox, past = subscribed(), FakePast(1, 4)
        outbox.resume(past, start=2)
        past.first, past.last = first, last

        assert waiting(outbox) == []
        outbox.put_frame(fake_frame(5))

        assert numbers(waiting(outbox)) == [5]

    run(test)


def test_credits_hold_back_frames_of_the_past_too() -> None:
    def test() -> None:
        outbox = subscribed(credit=2)
        outbox.resume(FakePast(1, 9), start=1)
        assert numbers(waiting(outbox)) == [1, 2]
        assert waiting(outbox) == []

        outbox.acknowledge(1)

        assert numbers(waiting(outbox)) == [3]

    run(test)


def test_a_rate_limit_thins_the_past_too() -> None:
    def test() -> None:
        outbox = subscribed(rate_hz=2.0)
        outbox.resume(FakePast(1, 20), start=1)  # ten frames a second

        assert numbers(waiting(outbox)) == [1, 6, 11, 16]

    run(test)


def test_a_new_subscription_ends_the_resuming() -> None:
    def test() -> None:
        outbox = subscribed()
        outbox.resume(FakePast(1, 9), start=1)
        outbox.subscribe((channel("direct", number=1),), credit=None)
        outbox.put_frame(fake_frame(10))

        assert numbers(waiting(outbox)) == [10]

    run(test)


@given(
    st.integers(1, 5),
    st.lists(st.sampled_from(["frame", "evict", "take", "ack"]), max_size=80),
    st.none() | st.integers(1, 3),
)
def test_whatever_happens_a_resuming_client_knows_of_every_frame(
    start: int, happenings: list[str], credit: int | None
) -> None:
    def test() -> None:
        past = FakePast(1, 5)
        outbox = subscribed(credit=credit)
        outbox.resume(past, start=start)
        items: list[Item] = []
        for happening in happenings:
            assert past.first is not None
            assert past.last is not None
            match happening:
                case "frame":
                    past.last += 1
                    outbox.put_frame(fake_frame(past.last))
                case "evict":
                    past.first = min(past.first + 1, past.last)
                case "take":
                    if (item := outbox._take()) is not None:
                        items.append(item)
                case _:
                    outbox.acknowledge(max([0, *numbers(items)]))
        outbox.acknowledge(2**53)
        while (item := outbox._take()) is not None:
            items.append(item)
            outbox.acknowledge(2**53)

        seen = set(numbers(items))
        for gap in reported(items):
            seen |= set(range(gap["from"], gap["to"] + 1))
        assert past.last is not None
        assert len(seen) + lost(items)[0] == past.last - start + 1
        assert numbers(items) == sorted(numbers(items))

    run(test)


def test_a_frame_that_parts_were_sent_of_is_kept_until_it_is_acknowledged() -> None:
    def test() -> None:
        outbox = Outbox(depth=1)
        part = replace(channel(), crop=Crop((0, 0, 1, 1)))
        outbox.subscribe((part,), credit=3)
        frames = [fake_frame(number) for number in (1, 2, 3)]
        for frame in frames:
            outbox.put_frame(frame)
            waiting(outbox)

        assert [outbox.partly_sent(number) for number in (1, 2, 3)] == [None, *frames[1:]]
        outbox.acknowledge(2)
        assert outbox.partly_sent(2) is None
        assert outbox.partly_sent(3) is frames[2]
        outbox.subscribe((part,), credit=3)
        assert outbox.partly_sent(3) is frames[2]  # a request for it may be on its way
        outbox.subscribe((part,), credit=None)
        assert outbox.partly_sent(3) is None

    run(test)


def test_of_frames_that_were_sent_whole_or_need_no_acknowledgement_none_is_kept() -> None:
    def test() -> None:
        whole = subscribed(credit=3)
        unlimited = Outbox(depth=1)
        unlimited.subscribe((replace(channel(), crop=Crop((0, 0, 1, 1))),), credit=None)
        for outbox in (whole, unlimited):
            outbox.put_frame(fake_frame(1))
            waiting(outbox)
            assert outbox.partly_sent(1) is None

    run(test)
