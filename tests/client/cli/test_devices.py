"""`transientcam devices`: cameras on USB and on the network."""

import json
from collections.abc import Callable
from importlib.metadata import EntryPoint
from typing import Any

import pytest

from transientcam.cli import devices, run
from transientcam.discovery import FoundCamera
from transientcam.errors import ServerUnreachable
from transientcam_driver import CameraUnreachable, LibusbMissing
from transientcam_driver.camera import FoundCamera as Camera
from transientcam_driver.cameras import tofcam660
from transientcam_driver.cameras.open_usb import _plugin as usb
from transientcam_driver.cameras.tofcam660 import AnswerType
from transientcam_driver.cameras.tofcam660._wire import Answer
from transientcam_simulation.entries import kinect2

FREE = Camera("usb:A-17", "A-17", "AMCW lidar", "/dev/bus/usb/001/004")
FORBIDDEN = Camera("usb", node="/dev/bus/usb/001/005", problem="no permission to open it")
ANNOUNCED = FoundCamera(
    name="lidar B-3",
    url="http://192.168.7.5:8000",
    serial="B-3",
    firmware="1.2",
    api="v1",
    tls=False,
    model="AMCW lidar",
    state="streaming",
)


@pytest.fixture(autouse=True)
def nothing_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """Start from empty buses and silent networks."""
    monkeypatch.setattr(usb, "list_cameras", lambda: ())
    monkeypatch.setattr(kinect2, "list_kinects", lambda: ())
    monkeypatch.setattr(devices, "discover", lambda **_: ())

    def no_device(address: str, *_: object, **__: object) -> None:
        raise CameraUnreachable(address)

    monkeypatch.setattr(tofcam660, "ControlConnection", no_device)


def plug(monkeypatch: pytest.MonkeyPatch, *cameras: Camera) -> None:
    monkeypatch.setattr(usb, "list_cameras", lambda: cameras)


def failing(error: Exception) -> Callable[..., Any]:
    def fail(**_: object) -> None:
        raise error

    return fail


def printed_by(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert run(["devices", *arguments]) == 0
    return " ".join(capsys.readouterr().out.split())


def listed(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(printed_by(capsys, "--json", *arguments))
    return document


def test_cameras_are_listed_by_the_name_that_opens_them(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    plug(monkeypatch, FREE, FORBIDDEN)
    monkeypatch.setattr(devices, "discover", lambda **_: (ANNOUNCED,))

    words = printed_by(capsys)

    assert "usb:A-17 A-17 AMCW lidar /dev/bus/usb/001/004" in words
    assert "/dev/bus/usb/001/005: no permission to open it" in words
    assert "http://192.168.7.5:8000 B-3 1.2 streaming lidar B-3" in words
    assert "Products that one cannot give: transientcam doctor --camera CAMERA" in words
    assert "sim:mirrors" in words


def test_cameras_are_printed_as_json(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    plug(monkeypatch, FREE, FORBIDDEN)
    monkeypatch.setattr(devices, "discover", lambda **_: (ANNOUNCED,))

    document = listed(capsys)

    assert [camera["spec"] for camera in document["cameras"]] == ["usb:A-17", "usb"]
    assert document["cameras"][1]["problem"] == "no permission to open it"
    assert document["network"] == [
        {
            "name": "lidar B-3",
            "url": "http://192.168.7.5:8000",
            "serial": "B-3",
            "firmware": "1.2",
            "api": "v1",
            "tls": False,
            "model": "AMCW lidar",
            "state": "streaming",
        }
    ]
    assert (document["problems"], document["network_problem"]) == ({}, None)
    assert document["cameras"][0]["kind"] == "usb"
    assert "sim:mirrors" in document["simulated"]


def test_an_empty_bus_and_a_silent_network_are_no_failure(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = printed_by(capsys)

    assert "No camera was found." in words
    assert "No camera announces itself on the network." in words


def test_the_network_is_searched_as_requested_or_not_at_all(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[dict[str, Any]] = []

    def heard(**how: Any) -> tuple[FoundCamera, ...]:
        asked.append(how)
        return ()

    monkeypatch.setattr(devices, "discover", heard)

    listed(capsys, "--timeout-s", "0.5", "--interface", "127.0.0.1")
    words = printed_by(capsys, "--no-network")

    assert asked == [{"timeout_s": 0.5, "interfaces": ["127.0.0.1"]}]
    assert "announces itself on the network" not in words


def test_a_missing_libusb_is_reported_beside_the_others(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def missing() -> None:
        raise LibusbMissing

    monkeypatch.setattr(usb, "list_cameras", missing)
    monkeypatch.setattr(devices, "discover", lambda **_: (ANNOUNCED,))

    assert "libusb-1.0 was not found" in printed_by(capsys)
    document = listed(capsys)
    assert "apt install" in document["problems"]["usb"]
    assert len(document["network"]) == 1


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (ServerUnreachable("the local network", "unreachable"), "cannot be searched: unreachable"),
        (ModuleNotFoundError("no", name="zeroconf"), "pip install 'transientcam[discovery]'"),
    ],
)
def test_a_network_that_cannot_be_searched_is_reported_beside_usb(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    error: Exception,
    words: str,
) -> None:
    plug(monkeypatch, FREE)
    monkeypatch.setattr(devices, "discover", failing(error))

    printed = printed_by(capsys)

    assert words in printed
    assert "usb:A-17" in printed


def test_each_kind_says_how_its_names_are_written(capsys: pytest.CaptureFixture[str]) -> None:
    kinds = {kind["name"]: kind for kind in listed(capsys)["kinds"]}

    assert kinds.keys() >= {"usb", "sim", "recording"}
    assert kinds["usb"]["usage"] == "usb[:SERIAL], usb:@BUS-PORTS"
    assert "noise" in kinds["sim"]["options"]
    assert "usb[:SERIAL], usb:@BUS-PORTS a camera on USB" in printed_by(capsys)


@pytest.mark.parametrize(
    ("value", "problem"),
    [
        ("transientcam_driver.not_there:PLUGIN", "pip install 'transientcam[driver]'"),
        ("math:pi", "AttributeError"),
    ],
)
def test_a_plug_in_that_fails_hides_no_other(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], value: str, problem: str
) -> None:
    points = [
        EntryPoint("odd", value, devices.GROUP),
        EntryPoint("usb", "transientcam_driver.cameras.open_usb._plugin:PLUGIN", devices.GROUP),
    ]
    monkeypatch.setattr(devices, "entry_points", lambda **_: points)
    plug(monkeypatch, FREE)
    monkeypatch.setattr(devices, "discover", lambda **_: (ANNOUNCED,))

    document = listed(capsys)

    assert problem in document["problems"]["odd"]
    assert [camera["spec"] for camera in document["cameras"]] == ["usb:A-17"]
    assert len(document["network"]) == 1


class _Answering:
    """The connection to a TOFcam660 that has its factory's address."""

    def __init__(self, address: str, *_: object, **__: object) -> None:
        self.address = address

    def exchange(self, command: int) -> Answer:
        return Answer(AnswerType.CHIP, bytes([0, 7, 0x10, 0x92]))

    def close(self) -> None:
        pass


def test_a_tofcam660_is_looked_for_at_its_factorys_address_on_the_network_only(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(tofcam660, "ControlConnection", _Answering)

    (camera,) = listed(capsys)["cameras"]

    assert (camera["spec"], camera["serial"]) == ("tofcam660:10.10.31.180", "7-4242")
    assert listed(capsys, "--no-network")["cameras"] == []
