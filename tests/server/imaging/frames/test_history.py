"""The last seconds of captures: which are there, in how many bytes, and what becomes of them."""

from types import SimpleNamespace
from typing import Any, cast

import pytest
from hypothesis import given, strategies as st

from transientcam_server.api._documents.frame import HistoryDocument
from transientcam_server.errors import Problem
from transientcam_server.imaging import Frame, History
from transientcam_server.settings import HistorySettings


class FakeFrame:
    """A frame that knows its number and images, and how often it was taken anew."""

    def __init__(self, number: int, size_bytes: int = 100, applied: object = "one") -> None:
        self.number = number
        self.size_bytes = size_bytes
        self.recipe = SimpleNamespace(applied=applied)

    def bare(self) -> "FakeFrame":
        return FakeFrame(self.number, self.size_bytes, self.recipe.applied)


class Clock:
    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def frame(number: int, size_bytes: int = 100, applied: object = "one") -> Frame:
    return cast("Frame", FakeFrame(number, size_bytes, applied))


def filled(
    count: int, *, every_s: float = 1.0, seconds: float = 10.0, max_bytes: int = 10_000
) -> History:
    clock = Clock()
    history = History(HistorySettings(seconds=seconds, max_bytes=max_bytes), clock=clock)
    for number in range(1, count + 1):
        clock.now_s = number * every_s
        history.append(frame(number))
    return history


def refusal(history: History, number: int) -> tuple[str, dict[str, Any]]:
    with pytest.raises(Problem) as caught:
        history.frame(number)
    return caught.value.kind.slug, dict(caught.value.extensions)


def test_before_the_first_frame_there_is_none() -> None:
    history = filled(0)

    assert (history.first, history.last, history.latest, history.count) == (None, None, None, 0)
    slug, extensions = refusal(history, 1)
    assert slug == "unknown-frame"
    assert extensions["limit"] is None


def test_frames_of_the_last_seconds_can_be_had() -> None:
    history = filled(30, seconds=10.0)

    assert (history.first, history.last, history.count) == (20, 30, 11)
    assert history.span_s == 10.0
    assert [history.frame(number).number for number in (20, 25, 30)] == [20, 25, 30]


def test_the_latest_frame_is_the_one_that_was_published() -> None:
    history = filled(3)
    newest = frame(4)
    history.append(newest)

    assert history.latest is newest
    assert history.frame(4) is newest


def test_a_former_frame_is_taken_anew_and_shared_for_a_while() -> None:
    history = filled(9)

    found = history.frame(5)

    assert found is not history.latest
    assert history.frame(5) is found  # what was computed of it serves the next request, too
    for number in (1, 2, 3):
        history.frame(number)
    assert history.frame(5) is not found  # but is not kept for ever


@pytest.mark.parametrize(
    ("number", "slug"),
    [(19, "frame-gone"), (1, "frame-gone"), (31, "unknown-frame"), (0, "unknown-frame")],
)
def test_a_frame_that_is_not_there_is_refused_with_those_that_are(number: int, slug: str) -> None:
    found, extensions = refusal(filled(30), number)

    assert found == slug
    assert (extensions["first"], extensions["last"]) == (20, 30)
    assert (extensions["field"], extensions["value"]) == ("frame", number)
    assert extensions["limit"] == "from 20 to 30"


def test_images_never_take_more_bytes_than_they_may() -> None:
    history = filled(30, max_bytes=550)

    assert (history.first, history.count) == (26, 5)
    assert history.size_bytes == 500


def test_a_frame_larger_than_all_the_room_is_there_only_while_it_is_the_latest() -> None:
    history = filled(3, max_bytes=1000)
    history.append(frame(4, size_bytes=1001))

    assert history.size_bytes == 0
    assert (history.first, history.last, history.count) == (4, 4, 1)
    assert history.frame(4) is history.latest
    assert refusal(history, 3)[0] == "frame-gone"
    history.append(frame(5))
    assert (history.first, history.last, history.size_bytes) == (5, 5, 100)


@given(
    sizes=st.lists(st.integers(0, 500), max_size=40),
    max_bytes=st.integers(0, 1000),
    seconds=st.floats(0.0, 20.0),
)
def test_whatever_comes_the_limits_hold_and_every_frame_between_first_and_last_is_there(
    sizes: list[int], max_bytes: int, seconds: float
) -> None:
    clock = Clock()
    history = History(HistorySettings(seconds=seconds, max_bytes=max_bytes), clock=clock)
    for number, size in enumerate(sizes, start=1):
        clock.now_s = float(number)
        history.append(frame(number, size))

        assert history.size_bytes <= max_bytes
        assert history.span_s <= seconds
        assert history.first is not None
        found = [history.frame(each) for each in range(history.first, number + 1)]
        assert [each.number for each in found] == list(range(history.first, number + 1))
        kept = sum(each.size_bytes for each in found)
        assert history.size_bytes == (kept if size <= max_bytes else 0)


def test_the_newest_seconds_are_those_before_the_newest_frame() -> None:
    history = filled(30)

    assert [each.number for each in history.newest(3.0)] == [27, 28, 29, 30]
    assert [each.number for each in history.newest(100.0)] == list(range(20, 31))
    assert filled(0).newest(1.0) == []


def test_the_newest_seconds_hold_one_sequence() -> None:
    history = filled(3)
    for number in (4, 5):
        history.append(frame(number, applied="another"))

    assert [each.number for each in history.newest(100.0)] == [4, 5]


def test_what_is_kept_and_its_limits_are_stated() -> None:
    assert HistoryDocument.model_validate(filled(30, max_bytes=550)).model_dump() == {
        "first": 26,
        "last": 30,
        "count": 5,
        "bytes": 500,
        "seconds": 4.0,
        "limit_bytes": 550,
        "limit_seconds": 10.0,
    }
