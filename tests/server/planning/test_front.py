"""Fronts of the present scene are kept for ten seconds; each frame has its own place in them."""

import asyncio
from typing import Any

import numpy as np
import pytest

from tests.server.planning.present import BASE, Bench, frame
from transientcam_driver import Capabilities, Sequence
from transientcam_server.planning import Progress, front_goal


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
            frame(3, capabilities),
            front_goal("range_error_m"),
            Progress(),
            Progress(show=shown.append),
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
                {
                    "median": 0.25,
                    "rms": pytest.approx(0.5 / np.sqrt(2)),
                    "no_direct_light_share": 0.0,
                }
                if simulated
                else None
            ),
        }

    asyncio.run(fronts())
