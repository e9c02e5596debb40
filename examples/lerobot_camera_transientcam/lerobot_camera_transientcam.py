"""A camera on the network as one of LeRobot's: direct light as the picture, z as the depth.

    pip install ./examples/lerobot_camera_transientcam
    lerobot-record --robot.cameras="{front: {type: transientcam, url: http://127.0.0.1:8000}}" ...

Both are of one captured frame. The picture is grey, (H, W, 3) uint8 and without multipath; the
depth, ``read_depth``, is (H, W) uint16 in mm along the optical axis, 0 where there is none.
"""

import threading
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from lerobot.cameras.camera import Camera
from lerobot.cameras.configs import CameraConfig
from numpy.typing import NDArray

import transientcam

_PRODUCTS = ("direct", "pointcloud")
_FIRST_S = 30.0


@CameraConfig.register_subclass("transientcam")
@dataclass(kw_only=True)
class TransientcamConfig(CameraConfig):
    """``white_dn``: direct light that is white; pictures of a data set need one fixed scale."""

    url: str = "http://127.0.0.1:8000"
    token: str | None = None
    white_dn: float = 1000.0


class Transientcam(Camera):  # type: ignore[misc]  # lerobot has no types
    """Reads the newest frame on a thread, so that a slow loop gets no old ones."""

    def __init__(self, config: TransientcamConfig) -> None:
        super().__init__(config)
        self._config = config
        self._changed = threading.Condition()
        self._frame: tuple[float, NDArray[np.uint8], NDArray[np.uint16]] | None = None
        self._new = False
        self._error: Exception | None = None
        self._camera: transientcam.Camera | None = None
        self._thread: threading.Thread | None = None

    @property
    def is_connected(self) -> bool:
        """Whether frames are read."""
        return self._thread is not None and self._thread.is_alive()

    @staticmethod
    def find_cameras() -> list[dict[str, Any]]:
        """Return the cameras that announce themselves on the local network."""
        return [{"type": "transientcam", "id": each.url} for each in transientcam.discover()]

    def connect(self, warmup: bool = True) -> None:
        """Begin to read; with ``warmup`` wait for the first frame."""
        if self.is_connected:
            raise RuntimeError(f"{self._config.url} is connected already")
        self._camera = transientcam.Camera(self._config.url, token=self._config.token)
        self._stream = self._camera.stream(*_PRODUCTS, reconnect=True, max_rate_hz=self.fps)
        self._frame, self._error = None, None
        self._thread = threading.Thread(target=self._follow, name="transientcam", daemon=True)
        self._thread.start()
        if warmup:
            self.async_read(timeout_ms=1000.0 * _FIRST_S)

    def read(self) -> NDArray[np.uint8]:
        """Return the picture of the next frame."""
        with self._changed:
            self._new = False
        return self.async_read(timeout_ms=1000.0 * _FIRST_S)

    def async_read(self, timeout_ms: float = 200.0) -> NDArray[np.uint8]:
        """Return the newest picture that was not returned yet.

        Raises
        ------
        TimeoutError
            If none comes in that time.
        """
        with self._changed:
            if not self._changed.wait_for(lambda: self._new or self._error, timeout_ms / 1000.0):
                raise TimeoutError(f"no frame of {self._config.url} within {timeout_ms:g} ms")
            self._new = False
            return self._newest()[1]

    def read_latest(self, max_age_ms: float = 500.0) -> NDArray[np.uint8]:
        """Return the newest picture, whether it was returned before or not.

        Raises
        ------
        TimeoutError
            If it came longer ago.
        """
        with self._changed:
            came_s, picture, _ = self._newest()
        if (age_ms := 1000.0 * (time.monotonic() - came_s)) > max_age_ms:
            raise TimeoutError(f"the newest frame is {age_ms:.0f} ms old, more than {max_age_ms:g}")
        return picture

    def read_depth(self) -> NDArray[np.uint16]:
        """Return the depth of the frame whose picture is the newest, in mm; 0 is none."""
        with self._changed:
            return self._newest()[2]

    def disconnect(self) -> None:
        """Stop reading."""
        if self._thread is None or self._camera is None:
            return
        self._stream.close()
        self._thread.join()
        self._camera.close()
        self._thread = None

    def _newest(self) -> tuple[float, NDArray[np.uint8], NDArray[np.uint16]]:
        if self._error is not None:
            raise RuntimeError(f"{self._config.url} is lost") from self._error
        if self._frame is None:
            raise RuntimeError(f"{self._config.url} has given no frame yet")
        return self._frame

    def _follow(self) -> None:
        direct = None
        try:
            for frame in self._stream:
                if frame.product == "direct":
                    direct = frame
                elif direct is not None and direct.frame == frame.frame:
                    found = time.monotonic(), self._picture(direct.array), _depth(frame.array[2])
                    with self._changed:
                        self._frame, self._new = found, True
                        self.height, self.width = found[2].shape
                        self._changed.notify_all()
        except transientcam.TransientcamError as error:
            with self._changed:
                self._error = error
                self._changed.notify_all()

    def _picture(self, direct_dn: NDArray[np.float32]) -> NDArray[np.uint8]:
        share = np.clip(np.nan_to_num(direct_dn) / self._config.white_dn, 0.0, 1.0)
        grey = np.rint(255.0 * share).astype(np.uint8)
        return np.repeat(grey[..., np.newaxis], 3, axis=-1)


def _depth(z_m: NDArray[np.float32]) -> NDArray[np.uint16]:
    z_mm = np.rint(1000.0 * np.nan_to_num(z_m))
    return np.where((z_mm > 0) & (z_mm < 65536), z_mm, 0).astype(np.uint16)
