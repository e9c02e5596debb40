"""The camera for LeRobot, made and read as LeRobot does; its own package is there without torch."""

import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from lerobot.cameras.utils import make_cameras_from_configs

from tests.conftest import ROOT
from tests.serving import serving
from transientcam import Camera

sys.path.insert(0, str(ROOT / "examples" / "lerobot_camera_transientcam"))
from lerobot_camera_transientcam import TransientcamConfig


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with serving("sim:mirrors?noise=off") as daemon:
        daemon.start_all_workers()
        yield daemon.url


@pytest.fixture
def camera(url: str) -> Iterator[Any]:
    (found,) = make_cameras_from_configs(
        {"front": TransientcamConfig(url=url, white_dn=500.0)}
    ).values()
    found.connect()
    yield found
    found.disconnect()
    assert not found.is_connected


def test_a_picture_and_a_depth_are_the_services_own(camera: Any, url: str) -> None:
    picture, depth_mm = camera.read(), camera.read_depth()
    with Camera(url) as service:
        direct_dn, z_m = (service.frame(name).array for name in ("direct", "pointcloud"))

    assert (picture.shape, picture.dtype) == ((120, 163, 3), np.uint8)
    np.testing.assert_allclose(picture[..., 0], np.clip(direct_dn / 500.0, 0, 1) * 255, atol=1.0)
    assert (depth_mm.shape, depth_mm.dtype) == ((120, 163), np.uint16)
    np.testing.assert_allclose(depth_mm, np.nan_to_num(1000.0 * z_m[2]), atol=1.0)
    assert (camera.width, camera.height) == (163, 120)


def test_each_read_is_of_another_frame_and_the_latest_may_be_seen_twice(camera: Any) -> None:
    seen = [camera.async_read(timeout_ms=20_000) for _ in range(2)]

    assert seen[0] is not seen[1]
    assert camera.read_latest(max_age_ms=60_000) is not None
    with pytest.raises(TimeoutError, match=r"more than 0"):
        camera.read_latest(max_age_ms=0.0)


def test_what_is_not_there_is_said(url: str) -> None:
    (absent,) = make_cameras_from_configs(
        {"front": TransientcamConfig(url=url.rsplit(":", 1)[0] + ":9")}
    ).values()

    assert not absent.is_connected
    with pytest.raises(RuntimeError, match="has given no frame yet"):
        absent.read_latest()
