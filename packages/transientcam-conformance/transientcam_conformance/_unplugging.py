"""A camera that is unplugged: notices, answers and recovery. Simulated cameras only."""

from collections.abc import Iterator
from contextlib import contextmanager

from transientcam_conformance._conversation import Conversation
from transientcam_conformance._device import API, Device
from transientcam_conformance._expecting import equal, expect


def an_unplugged_camera_is_reported(device: Device) -> None:
    """Streams get camera-lost with a reason; /readyz answers 503 with it, /livez still answers."""
    with _simulated(device) as stream, _unplugged(device):
        lost = stream.notice("camera-lost")
        expect(lost.details.get("reason"), "camera-lost has no reason")
        problem = device.refusal(device.send("GET", "/readyz"), 503, "not-ready")
        expect(problem.get("reasons"), "/readyz has no reasons")
        device.read("/livez")
        equal(device.camera["state"], "lost", "the state of the camera")


def a_lost_camera_refuses_and_remembers(device: Device) -> None:
    """Changes are refused with camera-lost; frames captured before can still be read."""
    with _simulated(device) as stream, _unplugged(device):
        stream.notice("camera-lost")
        body = {"takes": 2}
        device.refusal(device.send("PUT", f"{API}/sequence", json=body), 503, "camera-lost")
        device.read(f"{API}/frames/latest")


def a_camera_that_is_back_goes_on(device: Device) -> None:
    """After camera-back frames come with the same sequence, and their numbers go on."""
    with _simulated(device) as stream:
        before, sequence = stream.frame().frame, device.state()["sequence"]
        with _unplugged(device):
            stream.notice("camera-lost")
        stream.notice("camera-back")
        expect(stream.frame().frame > before, "frames are counted anew")
        equal(device.state()["sequence"], sequence, "the sequence after the camera came back")
        device.wait_until(
            lambda: device.send("GET", "/readyz").is_success, "/readyz is not ready again"
        )


def spoilt_images_are_counted(device: Device) -> None:
    """Lost or corrupt images cost their frame; a notice and the camera's counters count them."""
    for fault in ("corrupt-image", "drop-image"):
        with _simulated(device) as stream:
            _inject_fault(device, fault)
            notice = stream.notice("lost-images")
            expect(notice.details.get("count", 0) >= 1, f"{fault}: no lost image is counted")
            stream.frame()
    counters = device.camera["counters"]
    expect(counters["lost"] + counters["corrupt"] >= 2, "/camera counts no lost or corrupt image")


@contextmanager
def _simulated(device: Device) -> Iterator[Conversation]:
    device.require_simulation()
    with device.control(), device.capturing(), device.stream("flags") as stream:
        stream.frame()
        yield stream


@contextmanager
def _unplugged(device: Device) -> Iterator[None]:
    _inject_fault(device, "unplug")
    try:
        yield
    finally:
        _inject_fault(device, "replug")
        device.wait_until(lambda: device.camera["state"] != "lost", "the camera is not found again")


def _inject_fault(device: Device, fault: str) -> None:
    device.document(device.send("POST", f"{API}/simulation/faults", json={"fault": fault}))
