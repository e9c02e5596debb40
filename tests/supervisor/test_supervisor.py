"""The process that switches a light off: when it does, when it does not, and what it is made of.

The device is a socket here: a connection that is made and a message on it are the light going off.
"""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from tests.waiting import PATIENCE_S, wait_until
from transientcam_driver import open_camera
from transientcam_supervisor import (
    OffSwitch,
    Supervisor,
    SupervisorEnded,
    TcpMessage,
    UsbClaim,
    UsbControl,
    UsbRead,
    UsbReset,
    UsbSetting,
    UsbWrite,
)
from transientcam_supervisor._device import Device

SOON_S = 0.2
NEVER_S = 3600.0
OFF = b"off"
FORBIDDEN = {
    "h5py",
    "numba",
    "numpy",
    "usb",
    "usb1",
    "transientcam_driver",
    "transientcam_compiled",
}


class Light:
    """Listens for what switches it off."""

    def __init__(self, *, start_s: float = 0.0) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(PATIENCE_S)
        host, port = self._listener.getsockname()
        self.switch = OffSwitch(f"{host}:{port}", (TcpMessage(OFF),), start_s=start_s)

    def goes_off(self, *, answer: bytes = b"done") -> None:
        connection, _ = self._listener.accept()
        with connection:
            assert connection.recv(100) == OFF
            connection.sendall(answer)

    @property
    def asked(self) -> bool:
        """Whether somebody wants to switch it off."""
        self._listener.settimeout(0.0)
        try:
            self._listener.accept()[0].close()
        except BlockingIOError:
            return False
        finally:
            self._listener.settimeout(PATIENCE_S)
        return True

    def close(self) -> None:
        self._listener.close()


@pytest.fixture
def light() -> Iterator[Light]:
    light = Light()
    yield light
    light.close()


def watching(light: Light, *, silence_s: float = NEVER_S) -> Supervisor:
    supervisor = Supervisor(sys.executable, silence_s=silence_s)
    supervisor.watch(light.switch)
    return supervisor


@pytest.fixture
def supervisor(light: Light) -> Iterator[Supervisor]:
    """One that waits long for a word."""
    supervisor = watching(light)
    yield supervisor
    supervisor.end()


def test_an_off_switch_is_a_text_that_says_the_same() -> None:
    steps = (
        *(UsbClaim(0), UsbSetting(1, 0), UsbControl(0x40, signal.SIGTERM, 1, 2, b"\0\n'")),
        *(UsbWrite(2, b"abc"), UsbRead(0x81, 16), UsbReset(), TcpMessage(b"\xff")),
    )
    switch = OffSwitch("/dev/bus/usb/001/002", steps, 5.0, 0.3)

    assert OffSwitch.unpack(switch.pack()) == switch
    with pytest.raises(ValueError, match="malformed"):
        OffSwitch.unpack(b"__import__('os')")


def test_it_is_the_standard_library_on_one_thread(supervisor: Supervisor) -> None:
    code = "import sys, transientcam_supervisor.__main__; print(*sys.modules)"
    package = Path(sys.modules["transientcam_supervisor"].__path__[0]).parent
    imported = subprocess.run(
        [sys.executable, "-S", "-P", "-c", code],
        env=os.environ | {"PYTHONPATH": str(package)},
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()

    assert "transientcam_supervisor._device" in imported
    assert not FORBIDDEN & set(imported)
    assert psutil.Process(supervisor.pid).num_threads() == 1


def test_silence_switches_the_light_off_again_and_again_until_the_owner_knows(light: Light) -> None:
    supervisor = watching(light, silence_s=SOON_S)
    supervisor.alive()

    light.goes_off()
    light.goes_off()
    assert supervisor.alive() == "the supervisor heard nothing for 0.2 s"
    light.goes_off()  # the owner knows, but has not said that it is dark
    supervisor.dark()
    supervisor.close(dark=True)
    while light.asked:
        pass  # what was on its way

    assert not light.asked


def test_nothing_is_expected_of_an_owner_whose_light_is_off(light: Light) -> None:
    other = Light()
    supervisor = watching(light, silence_s=SOON_S)
    process = psutil.Process(supervisor.pid)
    process.suspend()  # or the silence could end between both
    supervisor.alive()
    supervisor.dark()
    process.resume()
    later = watching(other, silence_s=SOON_S)
    later.alive()

    other.goes_off()  # by then the time of the first is over, too
    assert not light.asked
    later.end()
    supervisor.close(dark=True)
    other.close()


def test_a_start_may_take_its_time(light: Light) -> None:
    slow = Light(start_s=NEVER_S)
    supervisor = watching(slow, silence_s=SOON_S)
    supervisor.starting()
    other = watching(light, silence_s=SOON_S)
    other.starting()

    light.goes_off()
    assert not slow.asked
    other.end()
    supervisor.close(dark=True)
    slow.close()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_at_its_own_end_it_switches_the_light_off_and_says_so(
    light: Light, supervisor: Supervisor, number: signal.Signals
) -> None:
    assert supervisor.pid is not None
    os.kill(supervisor.pid, number)

    light.goes_off()
    said: list[str] = []

    def says_why() -> bool:
        said.extend(filter(None, [supervisor.alive()]))
        return bool(said)

    wait_until(says_why)
    assert said == ["the supervisor was ended"]


def test_ended_while_the_light_may_be_on_it_first_switches_it_off(
    light: Light, supervisor: Supervisor
) -> None:
    process = supervisor._process
    assert process is not None
    process.terminate()

    light.goes_off(answer=b"")
    light.goes_off()  # again, since the first was not answered
    assert process.wait(PATIENCE_S) == 0


def test_it_outlives_its_owner_until_the_light_is_off(light: Light, supervisor: Supervisor) -> None:
    supervisor.alive()
    supervisor._link.close()  # as the kernel does at the owner's end

    light.goes_off(answer=b"")
    light.goes_off()  # again, since the first was not answered
    process = supervisor._process
    assert process is not None
    assert process.wait(PATIENCE_S) == 0


def test_an_owner_that_cannot_tell_has_it_switched_off(
    light: Light, supervisor: Supervisor
) -> None:
    supervisor.switch_off()

    light.goes_off(answer=b"")
    light.goes_off()
    assert supervisor.dark() is None


def test_one_that_is_gone_is_noticed_and_another_one_can_be_had(
    light: Light, supervisor: Supervisor
) -> None:
    first = supervisor.pid
    assert first is not None
    os.kill(first, signal.SIGKILL)

    def gone() -> bool:
        try:
            supervisor.alive()
        except SupervisorEnded:
            return True
        return False

    wait_until(gone)
    supervisor.watch(light.switch)
    assert supervisor.pid not in (None, first)


def test_one_that_says_nothing_is_taken_for_gone(light: Light) -> None:
    now_s = 0.0
    supervisor = Supervisor(sys.executable, silence_s=1.0, clock=lambda: now_s)
    supervisor.watch(light.switch)
    psutil.Process(supervisor.pid).suspend()
    supervisor.dark()
    now_s = 2.0
    supervisor.dark()
    now_s = 2.1

    with pytest.raises(SupervisorEnded, match="no answer for 2 s"):
        supervisor.dark()


def test_a_pause_of_both_is_noticed_by_the_owner(light: Light) -> None:
    now_s = 0.0
    supervisor = Supervisor(sys.executable, silence_s=100.0, clock=lambda: now_s)
    supervisor.watch(light.switch)
    assert supervisor.alive() is None
    now_s = 100.5

    assert supervisor.alive() == "the light was out of control for 100.5 s"
    assert supervisor.dark() is None
    assert supervisor.alive() is None
    supervisor.close(dark=True)


def test_sleep_of_the_machine_is_such_a_pause(
    light: Light, monkeypatch: pytest.MonkeyPatch
) -> None:
    slept_s = {time.CLOCK_BOOTTIME: 0.0}
    now = time.clock_gettime
    monkeypatch.setattr(time, "clock_gettime", lambda id_: now(id_) + slept_s.get(id_, 0.0))
    supervisor = Supervisor(sys.executable, silence_s=1e4)
    supervisor.watch(light.switch)
    assert supervisor.alive() is None
    slept_s[time.CLOCK_BOOTTIME] = 1.5e4  # before it would be taken for gone

    assert "the light was out of control for 1500" in str(supervisor.alive())
    supervisor.close(dark=True)


@pytest.mark.parametrize("program", [None, "/nowhere/python"])
def test_without_a_program_there_is_none(light: Light, program: str | None) -> None:
    with pytest.raises(SupervisorEnded, match=r"no Python|cannot be started"):
        Supervisor(program, silence_s=1.0).watch(light.switch)


def test_a_camera_that_it_cannot_reach_is_not_watched() -> None:
    supervisor = Supervisor(sys.executable, silence_s=1.0)

    with pytest.raises(SupervisorEnded, match="No such file"):
        supervisor.watch(OffSwitch("/nowhere", (UsbReset(),)))
    assert supervisor.pid is None


def test_a_tofcam660_takes_it_beside_its_owner() -> None:
    with open_camera("tofcam660:emulated?scene=wall") as camera:
        camera.start()
        assert camera.off_switch is not None
        assert Device(camera.off_switch).switch_off() is None
