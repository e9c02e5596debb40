"""Makes the camera of a service as LeRobot does, reads it, and fails where it is not that camera.

PYTHONPATH=build/lerobot:examples/lerobot_camera_transientcam python lerobot_reading.py URL
"""

import sys
from typing import Any

import numpy as np
from lerobot.cameras.utils import make_cameras_from_configs
from lerobot_camera_transientcam import TransientcamConfig

from transientcam import Camera


def made(url: str) -> Any:
    """Return the camera that LeRobot makes of a configuration."""
    (camera,) = make_cameras_from_configs(
        {"a": TransientcamConfig(url=url, white_dn=500.0)}
    ).values()
    return camera


def raises(kind: type[Exception], words: str, call: Any, **arguments: object) -> None:
    """Fail unless a call raises what it should."""
    try:
        call(**arguments)
    except kind as error:
        assert words in str(error), error  # noqa: PT017 - there is no pytest here
    else:
        raise AssertionError(words)


def main(url: str) -> None:
    """Read pictures and depths, and compare them with the service's own of a still scene."""
    camera = made(url)
    assert not camera.is_connected
    raises(RuntimeError, "has given no frame yet", camera.read_latest)
    camera.connect()
    raises(RuntimeError, "connected already", camera.connect)
    picture, depth_mm = camera.read(), camera.read_depth()
    with Camera(url) as service:
        direct_dn, z_m = (service.frame(name).array for name in ("direct", "pointcloud"))
    assert (picture.shape, picture.dtype) == ((120, 163, 3), np.uint8)
    np.testing.assert_allclose(picture[..., 0], np.clip(direct_dn / 500.0, 0, 1) * 255, atol=1.0)
    assert (depth_mm.shape, depth_mm.dtype) == ((120, 163), np.uint16)
    np.testing.assert_allclose(depth_mm, np.nan_to_num(1000.0 * z_m[2]), atol=1.0)
    assert (camera.width, camera.height) == (163, 120)
    seen = [camera.async_read(timeout_ms=20_000) for _ in range(2)]
    assert seen[0] is not seen[1]
    assert camera.read_latest(max_age_ms=60_000) is not None
    raises(TimeoutError, "more than 0", camera.read_latest, max_age_ms=0.0)
    camera.disconnect()
    assert not camera.is_connected
    sys.stdout.write("read")


if __name__ == "__main__":
    main(sys.argv[1])
