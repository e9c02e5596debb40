import asyncio
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.server.fakes import NOTICE, channel, fake_frame
from transientcam import wire
from transientcam_server.errors import Problem
from transientcam_server.hub import MAX_WAITING_MESSAGES, Delivery, Goodbye, Hub, Item, Outbox


def run(test: Callable[[], object]) -> None:
    async def main() -> None:
        result = test()
        if asyncio.iscoroutine(result):
            await result

    asyncio.run(main())


def waiting(outbox: Outbox) -> list[Item]:
    """Take everything an outbox would hand out now."""
    items = []
    while (item := outbox._take()) is not None:
        items.append(item)
    return items


def numbers(items: list[Item]) -> list[int]:
    return [item.frame.number for item in items if isinstance(item, Delivery)]


def subscribed(
    *, depth: int = 2, credit: int | None = None, rate_hz: float | None = None
) -> Outbox:
    outbox = Outbox(depth=depth)
    outbox.subscribe((channel(max_rate_hz=rate_hz),), credit=credit)
    return outbox


def test_the_newest_frames_wait_and_the_dropped_ones_are_counted() -> None:
    def test() -> None:
        outbox = subscribed(depth=2)
        for number in range(1, 6):
            outbox.put_frame(fake_frame(number))

        assert numbers(waiting(outbox)) == [4, 5]
        assert outbox.channels[0].dropped == 3

    run(test)


def test_nothing_is_dropped_from_one_who_keeps_up() -> None:
    def test() -> None:
        outbox = subscribed()
        for number in range(1, 6):
            outbox.put_frame(fake_frame(number))
            assert numbers(waiting(outbox)) == [number]

        assert outbox.channels[0].dropped == 0

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

        assert numbers(waiting(outbox)) == [5]
        assert outbox.channels[0].dropped == 2

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


def test_one_who_reads_no_messages_is_told_goodbye_instead_of_filling_the_memory() -> None:
    def test() -> None:
        outbox = subscribed()
        for _ in range(MAX_WAITING_MESSAGES + 1):
            outbox.put(NOTICE)

        (last,) = waiting(outbox)

        assert isinstance(last, Goodbye)
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
    rate_hz=st.floats(0.5, 40.0),
    frame_rate_hz=st.floats(1.0, 60.0),
    frames=st.integers(50, 300),
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


def test_everybody_gets_the_frame_and_the_news_but_not_before_they_subscribed() -> None:
    def test() -> None:
        hub = Hub()
        early, late = subscribed(), Outbox(depth=2)
        hub.join(early)
        hub.join(late)

        hub.publish(fake_frame(1, lost_images=3))

        delivery, notice = waiting(early)
        assert numbers([delivery]) == [1]
        assert notice == wire.Notice("lost-images", {"count": 3, "frame": 1})
        assert waiting(late) == []

    run(test)


def test_one_who_left_gets_nothing_more() -> None:
    def test() -> None:
        hub = Hub()
        outbox = subscribed()
        hub.join(outbox)
        assert not hub.deserted.is_set()
        hub.leave(outbox)

        hub.publish(fake_frame(1))

        assert waiting(outbox) == []
        assert hub.deserted.is_set()

    run(test)


def test_closing_says_goodbye_to_all_and_to_those_who_come_later() -> None:
    def test() -> None:
        hub = Hub()
        early, late = subscribed(), Outbox(depth=2)
        hub.join(early)

        hub.close()
        hub.join(late)

        for outbox in (early, late):
            (last,) = waiting(outbox)
            assert isinstance(last, Goodbye)
            assert last.code is wire.CloseCode.GOING_AWAY

    run(test)


def test_a_product_has_one_channel_number_for_all_clients() -> None:
    def test() -> None:
        hub = Hub()
        range_, direct = channel("range").product, channel("direct").product

        drawn = [hub.channel_number(product) for product in (range_, direct, range_)]

        assert drawn[0] == drawn[2] != drawn[1]

    run(test)


def test_waiting_for_a_frame_ends_with_it() -> None:
    async def test() -> None:
        hub = Hub()
        waiting_ = asyncio.ensure_future(hub.newest(after=1, wait_s=30.0))
        for number in (1, 2):
            hub.publish(fake_frame(number))
            await asyncio.sleep(0)

        assert (await waiting_).number == 2

    run(test)


@pytest.mark.parametrize("wait_s", [0.0, 0.01])
def test_waiting_for_a_frame_that_does_not_come_is_a_problem(wait_s: float) -> None:
    async def test() -> None:
        with pytest.raises(Problem) as caught:
            await Hub().newest(after=0, wait_s=wait_s)

        assert caught.value.kind.slug == "no-frame-yet"

    run(test)


def test_waiting_for_a_frame_ends_with_the_service() -> None:
    async def test() -> None:
        hub = Hub()
        waiting_ = asyncio.ensure_future(hub.newest(after=0, wait_s=30.0))
        await asyncio.sleep(0)
        hub.close()

        with pytest.raises(Problem) as caught:
            await waiting_

        assert caught.value.kind.slug == "shutting-down"

    run(test)
