import asyncio

import pytest

from tests.server.broadcast.outboxes import numbers, run, subscribed, waiting
from tests.server.fakes import fake_frame
from transientcam import wire
from transientcam_server.broadcast import Close, Hub, Outbox
from transientcam_server.errors import Problem


def test_every_subscriber_gets_frames_and_notices_but_not_before_it_subscribed() -> None:
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


def test_a_subscriber_that_left_gets_nothing_more() -> None:
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


def test_closing_sends_a_close_to_all_and_to_later_subscribers() -> None:
    def test() -> None:
        hub = Hub()
        early, late = subscribed(), Outbox(depth=2)
        hub.join(early)

        hub.close()
        hub.join(late)

        for outbox in (early, late):
            (last,) = waiting(outbox)
            assert isinstance(last, Close)
            assert last.code is wire.CloseCode.GOING_AWAY

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
        hub = Hub()
        hub.obstacle = lambda: "the camera is lost: no answer"
        with pytest.raises(Problem) as caught:
            await hub.newest(after=0, wait_s=wait_s)

        assert caught.value.kind.slug == "no-frame-yet"
        assert str(caught.value).endswith("of waiting: the camera is lost: no answer.")

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
