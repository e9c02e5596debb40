"""Looks at the present scene are kept for ten seconds."""

import asyncio

import pytest

from tests.server.planning.present import Bench
from transientcam_driver import Sequence


@pytest.mark.parametrize(("later_s", "again"), [(0.0, 1), (10.0, 1), (10.001, 2)])
def test_a_look_is_kept_for_ten_seconds(later_s: float, again: int) -> None:
    async def looks() -> None:
        bench = Bench()
        assert await bench.looked() == {"answer": 1}
        bench.now_s += later_s
        assert await bench.looked() == {"answer": again}
        assert len(bench.queue.asked) == again

    asyncio.run(looks())


def test_another_look_is_taken_for_another_base_or_ambient_light_or_scene() -> None:
    async def looks() -> None:
        bench = Bench()
        await bench.looked()
        assert await bench.looked(Sequence(harmonics=4)) == {"answer": 2}
        assert await bench.looked(Sequence(harmonics=4), 50.0) == {"answer": 3}
        assert await bench.looked(Sequence(harmonics=4), 50.0) == {"answer": 3}
        bench.looks.forget()
        assert await bench.looked(Sequence(harmonics=4), 50.0) == {"answer": 4}
        assert bench.queue.asked[-1][1:] == ("twin", Sequence(harmonics=4), 50.0, None)

    asyncio.run(looks())


def test_two_that_ask_at_once_get_one_look() -> None:
    async def looks() -> None:
        bench = Bench()
        both = await asyncio.gather(bench.looked(), bench.looked())
        assert list(both) == [{"answer": 1}] * 2

    asyncio.run(looks())


@pytest.mark.parametrize("twin", [True, False])
def test_a_frame_is_needed_where_there_is_no_twin(*, twin: bool) -> None:
    assert Bench(twin=twin).looks.needs_frame is not twin
