from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, strategies as st

from transientcam_server.recording import select, tags_of


def recording(name: str = "wall", **more: Any) -> dict[str, Any]:
    return {
        "id": f"id-{name}",
        "name": name,
        "camera": {"model": "AMCW", "serial": "0001"},
        "annotations": {},
        "started_s": 1.0,
        "frames": 2,
        "size_bytes": 10,
        "duration_s": 0.5,
    } | more


def names(*described: dict[str, Any], **wanted: Any) -> list[str]:
    return [each["name"] for each in select(described, **{"limit": 100} | wanted)["recordings"]]


CORNER = recording("Corner", annotations={"sample": "white Paint", "at": {"distance_m": 3.25}})
STREET = recording("Straße", camera={"model": "Kinect", "serial": "K2-77"})


@pytest.mark.parametrize(
    ("search", "found"),
    [
        ("", ["Straße", "Corner"]),
        ("corner", ["Corner"]),
        ("STRASSE", ["Straße"]),
        ("paint white", ["Corner"]),
        ("paint black", []),
        ("3.25", ["Corner"]),
        ("distance", ["Corner"]),
        ("kinect k2-77", ["Straße"]),
        ("id-Corner", ["Corner"]),
        ("corner null", []),
    ],
)
def test_all_words_of_a_search_are_found_wherever_they_stand(search: str, found: list[str]) -> None:
    assert names(CORNER, STREET, search=search) == found


@pytest.mark.parametrize(
    ("given", "tags"),
    [
        (["corner", " wet "], ["corner", "wet"]),
        ("corner, wet,, corner", ["corner", "wet"]),
        ([1, None, "wet"], ["wet"]),
        ({"corner": True}, []),
        (3, []),
        (None, []),
    ],
)
def test_tags_are_texts_of_one_annotation(given: object, tags: list[str]) -> None:
    assert tags_of({"tags": given}) == tags


def test_a_tag_chooses_and_is_counted_among_all_that_match() -> None:
    many = [recording(f"{n}", annotations={"tags": ["all", f"{n % 3}"]}) for n in range(9)]

    listing = select(many, tag="1", limit=1)

    assert listing["totals"]["recordings"] == 3
    assert listing["tags"] == {"all": 3, "1": 3}
    assert select(many, search="2", limit=100)["tags"] == {"all": 3, "2": 3}
    assert names(*many, tag="al") == []


def test_what_cannot_be_read_is_listed_last_by_its_time() -> None:
    damaged = recording("", started_s=None, camera={})

    assert names(damaged, CORNER) == ["Corner", ""]
    assert names(damaged, CORNER, order="started_s") == ["", "Corner"]


@given(
    sizes=st.lists(st.integers(0, 5), max_size=20),
    limit=st.integers(1, 7),
    order=st.sampled_from(["size_bytes", "-size_bytes", "-started_s"]),
)
def test_pages_are_together_the_whole_list_in_its_order(
    sizes: list[int], limit: int, order: Any
) -> None:
    many = [recording(f"{n:03}", size_bytes=size) for n, size in enumerate(sizes)]
    found: list[dict[str, Any]] = []
    offset: int | None = 0
    while offset is not None:
        page = select(many, order=order, offset=offset, limit=limit)
        assert page["totals"]["recordings"] == len(many)
        assert page["totals"]["size_bytes"] == sum(sizes)
        found.extend(page["recordings"])
        offset = page["next_offset"]

    assert sorted(each["id"] for each in found) == [each["id"] for each in many]
    if "size" in order:
        steps = [after["size_bytes"] - before["size_bytes"] for before, after in pairwise(found)]
        assert all(step <= 0 if order.startswith("-") else step >= 0 for step in steps)
