"""Stores of products beside recordings, as their own metadata describe them."""

import json
from pathlib import Path
from typing import Any

import pytest

from transientcam_server.recording._product_stores import ProductStores

ATTRIBUTES = {
    "format": "transientcam products",
    "recording_id": "r1",
    "title": "Möbius strip",
    "products": json.dumps(["range", "direct", 64]),
    "reconstruction": json.dumps({"estimator": "likelihood"}),
}


def store(
    directory: Path, name: str = "s1.zarr", *, frames: int | None = 7, **changes: Any
) -> Path:
    """A store that is complete, or without frames stated in it one that is written."""
    path = directory / name
    (path / "frame").mkdir(parents=True)
    group: dict[str, Any] = {"zarr_format": 3, "attributes": ATTRIBUTES | changes}
    if frames is not None:
        group["consolidated_metadata"] = {"metadata": {"frame": {"shape": [frames]}}}
    (path / "zarr.json").write_text(json.dumps(group), "utf-8")
    (path / "frame" / "zarr.json").write_text(json.dumps({"shape": [3]}), "utf-8")
    return path


def test_a_store_is_what_its_metadata_describe(tmp_path: Path) -> None:
    path = store(tmp_path)

    found = ProductStores(tmp_path).find("s1")

    assert found is not None
    assert (found.id, found.path, found.recording_id, found.title) == (
        "s1",
        path,
        "r1",
        "Möbius strip",
    )
    assert (found.products, found.bins, found.frames) == (("range", "direct"), 64, 7)
    assert found.reconstruction == {"estimator": "likelihood"}
    assert (found.complete, found.state) == (True, "complete")


def test_a_store_that_is_written_has_the_frames_of_its_axis(tmp_path: Path) -> None:
    store(tmp_path, frames=None)

    (found,) = ProductStores(tmp_path).all()

    assert (found.frames, found.complete, found.state) == (3, False, "unfinished")


def test_stores_are_listed_by_their_names(tmp_path: Path) -> None:
    for name in ("b.zarr", "a.zarr", "x" * 128 + ".zarr", "x" * 129 + ".zarr", "-a.zarr", "a.zip"):
        store(tmp_path, name)
    (tmp_path / "c.zarr").symlink_to(tmp_path / "a.zarr")
    (tmp_path / "d.zarr").mkdir()
    store(tmp_path, "e.zarr", format="products of another")

    stores = ProductStores(tmp_path)

    assert [each.id for each in stores.all()] == ["a", "b", "x" * 128]
    for name in ("c", "d", "e", "-a", "", "../a", "x" * 129):
        assert stores.find(name) is None
    assert ProductStores(tmp_path / "none").all() == []


@pytest.mark.parametrize(
    "changes",
    [
        {"products": "[]"},
        {"products": "range"},
        {"products": json.dumps(["range", "many"])},
        {"reconstruction": "12"},
        {"reconstruction": "[" * 100_000},
    ],
)
def test_what_reconstruct_would_not_write_is_no_store(
    tmp_path: Path, changes: dict[str, Any]
) -> None:
    store(tmp_path, **changes)

    assert ProductStores(tmp_path).find("s1") is None


@pytest.mark.parametrize(
    ("size_bytes", "readable"), [(4 * 1024**2, True), (4 * 1024**2 + 1, False)]
)
def test_metadata_of_at_most_four_mebibytes_are_read(
    tmp_path: Path, size_bytes: int, *, readable: bool
) -> None:
    path = store(tmp_path, padding="")
    short = len((path / "zarr.json").read_bytes())
    group = json.loads((path / "zarr.json").read_bytes())
    group["attributes"]["padding"] = "x" * (size_bytes - short)
    (path / "zarr.json").write_text(json.dumps(group), "utf-8")
    assert (path / "zarr.json").stat().st_size == size_bytes

    assert (ProductStores(tmp_path).find("s1") is not None) == readable


@pytest.mark.parametrize(
    ("key", "is_key"),
    [
        ("zarr.json", True),
        ("range/zarr.json", True),
        ("range/c", True),
        ("range/c/0", True),
        ("range/c/3/0/10", True),
        ("range/c" + 8 * "/0", True),
        ("range/c" + 9 * "/0", False),
        ("range/c/9999999999", True),
        ("range/c/10000000000", False),
        ("range/c/03", False),
        ("range/c/-1", False),
        ("range/c/٣", False),
        ("r" + 63 * "a" + "/c/0", True),
        ("r" + 64 * "a" + "/c/0", False),
        ("Range/c/0", False),
        ("../s1.zarr/zarr.json", False),
        ("range/../zarr.json", False),
        ("range", False),
        ("", False),
    ],
)
def test_only_keys_of_the_specification_become_paths(
    tmp_path: Path, key: str, *, is_key: bool
) -> None:
    path = store(tmp_path)
    found = ProductStores(tmp_path).find("s1")
    assert found is not None
    assert found.file("range/c/1/2/3") is None
    if key:
        place = path / key
        if not place.exists():
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(b"chunk")

    assert found.file(key) == (path / key if is_key else None)


def test_links_are_followed_within_a_store_alone(tmp_path: Path) -> None:
    path = store(tmp_path)
    (tmp_path / "secret").write_bytes(b"secret")
    chunks = path / "range" / "c"
    chunks.mkdir(parents=True)
    (chunks / "0").symlink_to(tmp_path / "secret")
    (chunks / "1").symlink_to(path / "zarr.json")
    found = ProductStores(tmp_path).find("s1")

    assert found is not None
    assert found.file("range/c/0") is None
    assert found.file("range/c/1") == chunks / "1"
