"""Which frames are computed on all cores."""

import os

import numpy as np
import pytest

import transientcam_moments as tm
from transientcam_driver import RawFrame
from transientcam_server.imaging._frames.stages import spread_of


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
