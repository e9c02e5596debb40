"""How a stream is started and stopped, and that the light goes off whatever fails."""

import struct
from typing import Any

import pytest

from tests.driver.cameras.kinect2.standing import P0, PARAMETERS, SERIAL, emulated, firmware, ignore
from transientcam_driver import CameraBusy, CameraError, CameraLost, CameraNotFound, ProtocolError
from transientcam_driver.cameras.kinect2 import Kinect2
from transientcam_driver.cameras.kinect2._device import READY_TRIES
from transientcam_driver.errors import TransferStalled
from transientcam_simulation.emulated._kinect2 import EmulatedKinect2
from transientcam_simulation.emulated._kinect2.device import EmulatedLink

# libfreenect2 @ fd64c5d, src/libfreenect2.cpp; numbers are commands with their parameters
IDENTIFY = ["awake", "2", "14", "22 1", "22 3", "22 2", "22 4"]
BEGIN = ["4b 1 640064 0 0", "4b 0 0 0 0", "16 90000", "9", "enabled", "16 90000", "2b 1", "images"]
END = ["no images", "disabled", "4b 1 640064 0 0", "4b 0 0 0 0", "a", "2b 0"]
END += ["4b 1 0 0 0", "4b 0 0 0 0"] * 2 + ["suspended"]
CLOSE = [*END, "4b 1 640064 0 0", "4b 0 0 0 0", "closed"]


class LoggedLink(EmulatedLink):
    """Keeps what is asked of it; the ``fails``-th action fails once, all from ``dies`` on."""

    def __init__(self, camera: EmulatedKinect2) -> None:
        super().__init__(camera)
        self.log: list[str] = []
        self.fails = self.dies = 1 << 30
        camera._link = self

    def _logged(self, action: str) -> None:
        self.log.append(action)
        if len(self.log) >= self.dies:
            raise CameraLost("no answer within 1 s")
        if len(self.log) == self.fails:
            raise TransferStalled

    def write(self, data: bytes) -> None:
        _, _, _, command, _, *parameters = struct.unpack(f"<{len(data) // 4}I", data)
        self._logged(" ".join(f"{each:x}" for each in (command, *parameters)))
        super().write(data)

    def set_suspended(self, suspended: bool) -> None:
        self._logged("suspended" if suspended else "awake")
        super().set_suspended(suspended)

    def set_stream_enabled(self, enabled: bool) -> None:
        self._logged("enabled" if enabled else "disabled")
        super().set_stream_enabled(enabled)

    def start_images(self, received: Any, failed: Any) -> None:
        self._logged("images")
        super().start_images(received, failed)

    def stop_images(self) -> None:
        if not self.log or self.log[-1] != "closed":
            self._logged("no images")
        super().stop_images()

    def close(self) -> None:
        self.log.append("closed")
        super().close()


def lit(camera: EmulatedKinect2) -> bool:
    return camera.lit


def opened(camera: EmulatedKinect2) -> tuple[Kinect2, LoggedLink]:
    link = LoggedLink(camera)
    return Kinect2(link, pause=ignore), link


def test_requests_come_in_the_order_that_the_camera_is_known_to_take() -> None:
    kinect, link = opened(emulated())
    assert link.log == [*IDENTIFY, *END]

    link.log.clear()
    kinect.start(ignore, ignore)
    assert link.log == [*IDENTIFY, *BEGIN]

    link.log.clear()
    kinect.stop()
    assert link.log == END

    link.log.clear()
    kinect.close()
    kinect.close()
    assert link.log == CLOSE


def test_what_the_camera_says_of_itself_is_read_when_it_is_opened() -> None:
    kinect, _ = opened(emulated())
    found = kinect.identity

    assert (found.firmware, found.serial) == ("2.3.3913.7", SERIAL)
    assert (found.parameters, found.p0) == (PARAMETERS, P0)


def test_a_light_that_another_program_left_on_goes_off_when_the_camera_is_opened() -> None:
    camera = emulated()
    left, link = opened(camera)
    left.start(ignore, ignore)
    EmulatedLink.stop_images(link)
    assert camera.lit

    camera._link = None
    opened(camera)

    assert not camera.lit


@pytest.mark.parametrize("at", range(1, len(IDENTIFY + BEGIN) + 1))
def test_a_start_that_fails_anywhere_leaves_the_light_off(at: int) -> None:
    camera = emulated()
    kinect, link = opened(camera)
    link.fails = len(link.log) + at

    with pytest.raises(CameraError):
        kinect.start(ignore, ignore)

    assert not lit(camera)
    assert link.log[-len(END) :] == END
    kinect.start(ignore, ignore)
    assert lit(camera)
    kinect.close()
    assert not lit(camera)


@pytest.mark.parametrize("at", range(1, len(END) + 1))
def test_a_stop_that_fails_anywhere_goes_on_and_says_so(at: int) -> None:
    camera = emulated()
    kinect, link = opened(camera)
    kinect.start(ignore, ignore)
    link.fails = len(link.log) + at

    with pytest.raises(CameraError, match="stalled"):
        kinect.stop()

    assert link.log[-len(END) :] == END
    assert not camera.lit
    kinect.close()


def test_a_camera_that_answers_no_more_is_closed_all_the_same() -> None:
    camera = emulated()
    kinect, link = opened(camera)
    kinect.start(ignore, ignore)
    link.dies = len(link.log) + 1

    kinect.close()

    assert link.log[-1] == "closed"


def test_another_camera_than_the_wanted_one_is_given_back() -> None:
    camera = emulated()

    with pytest.raises(CameraNotFound, match="000"):
        Kinect2(camera.connect(), pause=ignore, serial="000")

    assert Kinect2(camera.connect(), pause=ignore, serial=SERIAL).identity.serial == SERIAL


def test_a_camera_is_opened_once() -> None:
    camera = emulated()
    camera.connect()

    with pytest.raises(CameraBusy):
        camera.connect()


def test_the_status_is_asked_for_until_the_camera_is_ready() -> None:
    camera = emulated()
    pauses: list[float] = []
    camera.firmware = firmware(polls=4)
    kinect = Kinect2(camera.connect(), pause=pauses.append)
    kinect.start(ignore, ignore)
    assert pauses == [0.1] * 3

    kinect.stop()
    camera.firmware = firmware(polls=READY_TRIES + 1)
    with pytest.raises(CameraError, match="not ready within 5 s"):
        kinect.start(ignore, ignore)
    assert not camera.lit


class OddLink(EmulatedLink):
    """Changes the answer to one request."""

    def __init__(self, camera: EmulatedKinect2, command: int, answers: list[bytes]) -> None:
        super().__init__(camera)
        camera._link = self
        self._command, self._answers = command, answers
        self._odd: list[bytes] = []

    def write(self, data: bytes) -> None:
        super().write(data)
        self._odd = list(self._answers) if data[12] == self._command else []

    def read(self, most_bytes: int) -> bytes:
        return self._odd.pop(0) if self._odd else super().read(most_bytes)


COMPLETION = bytes.fromhex("00e06f0a 00000000 00000000 00000000")


@pytest.mark.parametrize(
    ("command", "answers", "reason"),
    [
        (0x02, [bytes(100), COMPLETION], "READ_FIRMWARE_VERSIONS has 100 bytes, at least 512"),
        (0x14, [COMPLETION], "READ_HARDWARE was completed without an answer"),
        (0x22, [bytes(0x80), bytes(16)], "READ_DATA 0x1 was not completed"),
    ],
)
def test_an_answer_that_is_none_is_named(command: int, answers: list[bytes], reason: str) -> None:
    with pytest.raises(ProtocolError, match=reason):
        Kinect2(OddLink(emulated(), command, answers), pause=ignore)


def test_a_completion_of_another_request_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    answers = [bytes(0x5C), COMPLETION[:4] + b"\x63" + COMPLETION[5:]]

    Kinect2(OddLink(emulated(), 0x14, answers), pause=ignore)

    assert "READ_HARDWARE: completion of 99, not of 1" in caplog.text
