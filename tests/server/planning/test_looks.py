"""Looks at the present scene are kept for ten seconds, and fronts like them."""

import asyncio
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from transientcam_driver import Capabilities, Sequence, SubPhases
from transientcam_server.imaging import Frame, Workers
from transientcam_server.planning import FrontCache, Goal, Looks, Planner, PlanningQueue, Progress

BASE = Sequence(harmonics=3, takes=2, sub_phases=SubPhases("none"))


class Queue:
    """Computes nothing; what it is asked for gets numbers."""

    def __init__(self) -> None:
        self.asked: list[tuple[Any, ...]] = []

    async def run(self, _: object, *arguments: object, progress: Progress) -> Any:
        self.asked.append(arguments)
        progress.show({"part": len(self.asked)})
        await asyncio.sleep(0)
        return {"answer": len(self.asked)}


class Threads:
    """Computes at once."""

    async def run(self, compute: Callable[..., Any], *arguments: object) -> Any:
        return compute(*arguments), 0.0

    async def run_long(self, compute: Callable[..., Any], *arguments: object) -> Any:
        return compute(*arguments), 0.0


class Bench:
    """Looks and fronts of one camera, with a clock that the test moves."""

    def __init__(self, *, twin: bool = True, simulated: bool = True) -> None:
        self.now_s = 100.0
        self.queue = Queue()
        planner = cast(
            Planner,
            SimpleNamespace(require_possible=lambda: None, tradeoff_document=lambda *_: None),
        )
        workers, queue = cast(Workers, Threads()), cast(PlanningQueue, self.queue)
        opened = cast(Any, (lambda: "twin") if twin else None)
        self.looks = Looks(planner, workers, queue, opened, clock=lambda: self.now_s)
        self.fronts = FrontCache(
            planner,
            workers,
            queue,
            self.looks,
            simulated=simulated,
            clock=lambda: self.now_s,
        )

    async def looked(self, base: Sequence = BASE, ambient: float | None = None) -> Any:
        return await self.looks.of_twin(base, ambient, Progress())

    async def front(self, frame: Frame, by: str = "range_error_m") -> dict[str, Any]:
        return await self.fronts.of(frame, by, Progress(), Progress())

    @property
    def goals(self) -> list[tuple[Goal, Any]]:
        """Goals of the fronts that were computed, and the scenes they are for."""
        return [asked for asked in self.queue.asked if isinstance(asked[0], Goal)]


def frame(number: int, capabilities: Capabilities, *, epoch: int = 1, version: int = 1) -> Frame:
    async def nothing(*_: object) -> None: ...

    async def found(_: str) -> object:
        return SimpleNamespace(range_m=np.array([1.5, 2.5, np.nan]))

    async def truth() -> object:
        return SimpleNamespace(range_m=np.array([1.0, 2.5, 3.0]))

    recipe = SimpleNamespace(applied=capabilities.apply(BASE), settings_version=version)
    made = SimpleNamespace(
        number=number,
        raw=SimpleNamespace(epoch=epoch),
        recipe=recipe,
        reconstruction=found,
        accuracy=nothing,
        truth=truth,
        meta=lambda: {"frame": number},
    )
    return cast(Frame, made)


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
        assert bench.queue.asked[-1][1:] == ("twin", Sequence(harmonics=4), 50.0)

    asyncio.run(looks())


def test_two_that_ask_at_once_get_one_look() -> None:
    async def looks() -> None:
        bench = Bench()
        assert await asyncio.gather(bench.looked(), bench.looked()) == [{"answer": 1}] * 2

    asyncio.run(looks())


@pytest.mark.parametrize("twin", [True, False])
def test_a_frame_is_needed_where_there_is_no_twin(*, twin: bool) -> None:
    assert Bench(twin=twin).looks.needs_frame is not twin


@pytest.mark.parametrize(("later_s", "again"), [(0.0, 5), (10.0, 5), (10.001, 9)])
def test_a_front_is_kept_for_ten_seconds_with_the_frame_it_is_of(
    later_s: float, again: int, capabilities: Capabilities
) -> None:
    async def fronts() -> None:
        bench = Bench()
        assert (await bench.front(frame(5, capabilities)))["scene_of_frame"] == 5
        bench.now_s += later_s
        later = await bench.front(frame(9, capabilities))
        assert later["scene_of_frame"] == again
        assert later["current"]["meta"] == {"frame": 9}
        assert len(bench.goals) == (1 if again == 5 else 2)

    asyncio.run(fronts())


def test_a_front_is_computed_again_for_another_sequence_setting_target_or_scene(
    capabilities: Capabilities,
) -> None:
    async def fronts() -> None:
        bench = Bench()
        for count, (by, epoch, version) in enumerate(
            [
                ("range_error_m", 1, 1),
                ("range_error_m", 2, 1),
                ("range_error_m", 2, 2),
                ("range_std_m", 2, 2),
                ("bound_width", 2, 2),
            ],
            start=1,
        ):
            one = frame(1, capabilities, epoch=epoch, version=version)
            for _ in range(2):
                assert (await bench.front(one, by))["compared_by"] == by
                assert len(bench.goals) == count
                assert bench.goals[-1][0].leading == by
        bench.fronts.forget()
        await bench.front(frame(1, capabilities, epoch=2, version=2), "bound_width")
        assert len(bench.goals) == 6
        assert all(goal.limits == {} or min(goal.limits.values()) >= 1e6 for goal, _ in bench.goals)

    asyncio.run(fronts())


def test_a_twin_looks_at_all_frequencies_and_only_the_base_stays(
    capabilities: Capabilities,
) -> None:
    async def fronts() -> None:
        bench = Bench()
        await bench.front(frame(1, capabilities))
        base = bench.queue.asked[0][2]
        assert base == Sequence(
            base_frequency_hz=BASE.base_frequency_hz, sub_phases=BASE.sub_phases
        )
        assert bench.goals[0][0].base == base

    asyncio.run(fronts())


def test_who_waits_for_a_front_sees_its_parts(capabilities: Capabilities) -> None:
    async def fronts() -> None:
        bench = Bench()
        shown: list[dict[str, Any]] = []
        await bench.fronts.of(
            frame(3, capabilities), "range_error_m", Progress(), Progress(show=shown.append)
        )
        assert [(each["part"], each["scene_of_frame"]) for each in shown] == [(2, 3)]

    asyncio.run(fronts())


@pytest.mark.parametrize("simulated", [True, False])
def test_the_frames_own_place_has_its_error_where_the_truth_is_known(
    capabilities: Capabilities, *, simulated: bool
) -> None:
    async def fronts() -> None:
        found = await Bench(simulated=simulated).front(frame(3, capabilities))
        applied = capabilities.apply(BASE)
        assert found["current"] == {
            "meta": {"frame": 3},
            "sequence": applied.sequence.to_document(),
            "capture_s": applied.capture_s,
            "frame_rate_hz": applied.frame_rate_hz,
            # of the two pixels with a range, 0.5 m and nothing off
            "range_error_m": (
                {"median": 0.25, "rms": pytest.approx(0.5 / np.sqrt(2))} if simulated else None
            ),
        }

    asyncio.run(fronts())
