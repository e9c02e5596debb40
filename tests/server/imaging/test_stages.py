"""What of a frame is computed on all cores, and when."""

import os
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import transientcam_moments as tm
from transientcam_driver import RawFrame
from transientcam_server.imaging.recipe import Recipe
from transientcam_server.imaging.stages import Computed, compute, spread_of


def raw(height: int, width: int) -> RawFrame:
    images = np.zeros((4, height, width), np.uint16)
    return RawFrame(
        images=images,
        labels=(),
        number=1,
        epoch=1,
        device_time_s=0.0,
        host_time_s=0.0,
        capture_s=0.1,
        temperature_c=25.0,
        lost_images=0,
    )


def test_a_frame_of_the_papers_size_is_computed_on_one_core() -> None:
    assert spread_of(raw(120, 163)) is tm.kernels.at_once


@pytest.mark.skipif(len(os.sched_getaffinity(0)) == 1, reason="there is one core")
def test_a_large_frame_is_computed_on_all_cores() -> None:
    parts: list[tuple[int, int]] = []

    spread_of(raw(480, 640))(lambda start, stop: parts.append((start, stop)), 480 * 640)

    assert len(parts) > 1
    assert sorted(parts)[0][0] == 0
    assert sorted(parts)[-1][1] == 480 * 640


class _Found:
    """A reconstruction that tells what is read of it."""

    def __init__(self, read: list[str]) -> None:
        self._read = read

    def __getattr__(self, name: str) -> Any:
        self._read.append(name)
        if name == "coefficients":
            raise ArithmeticError
        return np.zeros((2, 2), np.uint8)


def test_cores_are_free_once_all_stages_are_computed_also_where_one_fails() -> None:
    read: list[str] = []
    found = _Found(read)
    applied = SimpleNamespace(sequence=None)
    recipe = SimpleNamespace(reconstruct=lambda *_, **__: found, applied=applied, sensor=None)
    stages = ("returns", "coefficients")

    computed = compute(
        Computed(),
        cast("Recipe", recipe),
        raw(2, 2),
        None,
        stages,
        cores_free=lambda: read.append("free"),
    )

    before, after = read[: read.index("free")], read[read.index("free") + 1 :]
    assert {"flags", "range_m", "coefficients"} <= set(before)
    assert set(after) == {"flags"}  # which are counted
    assert list(computed.failures) == ["coefficients"]
    assert computed.pixels is not None


def test_cores_are_not_waited_for_where_the_reconstruction_fails() -> None:
    def fail(*_: object, **__: object) -> None:
        raise ArithmeticError

    freed: list[bool] = []
    recipe = cast("Recipe", SimpleNamespace(reconstruct=fail, sensor=None))

    computed = compute(
        Computed(), recipe, raw(2, 2), None, ("light",), cores_free=lambda: freed.append(True)
    )

    assert computed.reconstruction is None
    assert list(computed.failures) == ["light"]
    assert not freed  # the frame says so itself when it has failed
