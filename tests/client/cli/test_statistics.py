"""Rates and counts of a stream."""

import numpy as np
import pytest

from tests.client.conftest import frame_meta
from transientcam import Frame, Notice
from transientcam.cli.statistics import Statistics


def _frame(number: int, *, product: str = "range", host_time_s: float = 0.0) -> Frame:
    axes = ("y", "x") if product == "range" else ("moment", "y", "x")
    array = np.array([1.0, 2.0, np.nan, 9.0], "<f4").reshape(
        (1, 4) if product == "range" else (2, 1, 2)
    )
    return Frame(product, "m", axes, frame_meta(frame=number, host_time_s=host_time_s), array)


def test_the_rate_is_that_of_the_arrivals_in_the_last_seconds() -> None:
    statistics = Statistics()

    slow = [statistics.frame(_frame(n), now_s=1.0 * n).rate_hz for n in range(4)]
    fast = [statistics.frame(_frame(100 + n), now_s=100.0 + 0.1 * n).rate_hz for n in range(20)]

    assert slow == [None, 1.0, 1.0, 1.0]
    assert fast[0] is None
    assert fast[1:] == pytest.approx([10.0] * 19)


def test_several_products_of_a_frame_are_one_frame() -> None:
    statistics = Statistics()
    for number in range(5):
        for product in ("range", "moments"):
            sample = statistics.frame(_frame(number, product=product), now_s=0.5 * number)

    assert sample.rate_hz == pytest.approx(2.0)


def test_two_frames_at_once_are_no_infinite_rate() -> None:
    statistics = Statistics()
    statistics.frame(_frame(1), now_s=1.0)

    assert statistics.frame(_frame(2), now_s=1.0).rate_hz is None


def test_a_sample_says_what_was_seen_and_lost() -> None:
    statistics = Statistics()
    for notice in (
        Notice("dropped", {"channel": 0, "count": 2, "total": 2}),
        Notice("dropped", {"channel": 0, "count": 3, "total": 5}),
        Notice("lost-images", {"count": 4, "frame": 1}),
        Notice("camera-lost", {"reason": "unplugged"}),
        Notice("dropped", {"count": "many"}),
    ):
        statistics.notice(notice)

    sample = statistics.frame(_frame(1, host_time_s=10.0), now_s=10.25)

    assert sample.to_document() == {
        "type": "frame",
        "frame": 1,
        "product": "range",
        "unit": "m",
        "rate_hz": None,
        "latency_s": 0.25,
        "median": 2.0,
        "dropped": 5,
        "lost_images": 4,
    }


def test_there_is_no_median_of_what_is_no_image_or_has_no_value() -> None:
    dark = Frame(
        "range", "m", ("y", "x"), frame_meta(frame=2, host_time_s=0.0), np.full((1, 1), np.nan)
    )

    assert Statistics().frame(_frame(1, product="moments"), now_s=0.0).median is None
    assert Statistics().frame(dark, now_s=0.0).median is None
