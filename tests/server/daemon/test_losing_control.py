"""The light goes off where the daemon loses control of it, whichever camera it is.

Nothing here is timed: each test waits until the camera itself says that its light is off. `python
-m tests.server.daemon.losing_control` says how long that takes.
"""

import signal
from collections.abc import Iterator

import pytest

from tests.driver.cameras.open_usb.usbfs.processes import missing_libraries, skip_or_fail
from tests.server.daemon.losing_control import EVENTS, KINDS, Control, Zygote, controlled, lose
from tests.waiting import wait_until

FEWER = "stuck camera thread", "USB stall", "supervisor SIGKILL", "SIGSTOP", "SIGKILL"
"""Of all events those in which the kind of camera matters."""


@pytest.fixture(scope="module")
def zygote() -> Iterator[Zygote]:
    if missing := missing_libraries():
        skip_or_fail(missing)
    zygote = Zygote()
    yield zygote
    zygote.close()


@pytest.fixture(scope="module")
def usb(zygote: Zygote) -> Iterator[Control]:
    with controlled(zygote, "usb") as control:
        yield control


@pytest.fixture(scope="module")
def kinect2(zygote: Zygote) -> Iterator[Control]:
    pytest.importorskip("usb1", reason="the package libusb1 is missing")
    # its frames are large: a machine that is laden takes seconds for what is on its thread
    with controlled(zygote, "kinect2", silence_s=5.0) as control:
        yield control


@pytest.fixture(scope="module")
def opt8241(zygote: Zygote) -> Iterator[Control]:
    with controlled(zygote, "opt8241") as control:
        yield control


@pytest.mark.parametrize("event", EVENTS)
def test_the_prototype_goes_dark(usb: Control, event: str) -> None:
    lose(usb, event)


@pytest.mark.parametrize("event", FEWER)
def test_a_kinect_goes_dark_which_has_no_watchdog(kinect2: Control, event: str) -> None:
    lose(kinect2, event)


@pytest.mark.parametrize("event", FEWER)
def test_an_opt8241_goes_dark_which_has_no_watchdog(opt8241: Control, event: str) -> None:
    lose(opt8241, event)


@pytest.mark.parametrize("kind", KINDS)
def test_after_a_restart_it_stays_dark_until_somebody_starts(
    request: pytest.FixtureRequest, kind: str
) -> None:
    control: Control = request.getfixturevalue(kind)
    lose(control, "SIGKILL")
    assert control.stays_off()


def test_after_a_pause_it_stays_dark_until_somebody_starts(opt8241: Control) -> None:
    opt8241.light()
    opt8241.goes_off(opt8241.signal(signal.SIGSTOP))
    opt8241.process.send_signal(signal.SIGCONT)  # type: ignore[union-attr]  # it is there

    wait_until(lambda: opt8241.state()[0] == "stopped")
    assert not opt8241.camera.lit
    assert "the supervisor heard nothing for 1 s" in str(opt8241.state()[1])
    opt8241.light()
    assert opt8241.state()[1] is None
