"""Measuring all points of a scene, and resuming after an interruption."""

from dataclasses import replace
from pathlib import Path

import pytest

from transientcam_driver import Sequence
from transientcam_experiments import tradeoff

SMALL = tradeoff.Grid(tuple(Sequence(harmonics=m) for m in (1, 2, 3, 4)), (2,), (16,))


def test_a_scene_that_moves_is_held_against_the_truth_of_each_frame(tmp_path: Path) -> None:
    grid = tradeoff.Grid((Sequence(harmonics=2, zeroth="estimated", exposure_s=0.0005),), ())
    points = tradeoff.points_of(grid, scene="visitor", repetitions=3, seed=1)
    records = tradeoff.Records(tmp_path)

    tradeoff.measure(points, records, scene="visitor", seed=1, progress=lambda kind: None)

    (found,) = records
    assert 0 < (found.values["range_median_m"] or 0) < 0.03


class StoppedError(Exception):
    pass


def test_an_interrupted_run_goes_on_where_it_stopped(tmp_path: Path) -> None:
    captures = replace(SMALL, harmonics=())  # what is timed takes its time
    points = tradeoff.points_of(captures, scene="mirrors", repetitions=2, seed=3)
    done: list[str] = []

    def stop_after_two(kind: str) -> None:
        done.append(kind)
        if len(done) == 2:
            raise StoppedError

    with pytest.raises(StoppedError):
        tradeoff.measure(
            points, tradeoff.Records(tmp_path), scene="mirrors", seed=3, progress=stop_after_two
        )
    kept = (tmp_path / "points.jsonl").read_bytes()
    resumed = tradeoff.Records(tmp_path)
    assert len(resumed) == 2

    again: list[str] = []
    tradeoff.measure(points, resumed, scene="mirrors", seed=3, progress=again.append)

    assert (tmp_path / "points.jsonl").read_bytes().startswith(kept)
    assert len(again) == len(points) == len(resumed)
    whole = tradeoff.Records(tmp_path / "in one go")
    tradeoff.measure(points, whole, scene="mirrors", seed=3, progress=again.append)
    assert list(tradeoff.Records(tmp_path)) == list(whole)
