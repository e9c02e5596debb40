"""The service on the local network; on the loopback interface, out of reach of others."""

import socket
import time
from pathlib import Path

import httpx
import pytest

from tests.serving import serving
from tests.waiting import wait_until
from transientcam import Camera, discover
from transientcam.discovery import FoundCamera
from transientcam_server.daemon import _announcement as announcement
from transientcam_server.daemon._announcement import (
    _addresses,
    _instance,
    enabled,
    inside_container,
)
from transientcam_server.settings import Settings

LOOPBACK = ["127.0.0.1"]


def found_at(url: str, *, patience_s: float = 60.0) -> FoundCamera | None:
    """Listen until a camera at this address is announced; another test's may be there, too."""
    ends_s = time.monotonic() + patience_s
    while time.monotonic() < ends_s:
        for each in discover(timeout_s=0.4, interfaces=LOOPBACK):
            if each.url == url:
                return each
    return None


def test_an_announced_service_is_found_can_be_used_and_is_withdrawn_at_its_end() -> None:
    with serving("sim:wall?noise=off", announce="on") as served:
        found = found_at(served.url)
        assert found is not None
        with Camera(found.url) as camera:
            capabilities = camera.camera["capabilities"]
        reported = (found.serial, found.firmware, found.api, found.tls)
        assert reported == (capabilities["serial"], str(capabilities["firmware"]), "v1", False)
        assert capabilities["model"] in found.name

    assert found.url not in {each.url for each in discover(timeout_s=0.5, interfaces=LOOPBACK)}


def test_two_services_with_the_same_camera_have_names_of_their_own() -> None:
    # one after the other: of two that ask for a name at the same time, neither knows of the other
    with serving("sim:wall", announce="on") as first:
        earlier = found_at(first.url)
        assert earlier is not None
        later = earlier
        while later.name == earlier.name:
            # a laden machine may say too late that it has the name: the limit of the test ends it
            with serving("sim:wall", announce="on") as second:
                found = found_at(second.url)
            assert found is not None
            later = found


@pytest.mark.parametrize(
    ("announce", "host", "container", "expected"),
    [
        ("auto", "127.0.0.1", False, False),
        ("auto", "0.0.0.0", False, True),
        ("auto", "0.0.0.0", True, False),
        ("on", "127.0.0.1", True, True),
        ("off", "0.0.0.0", False, False),
    ],
)
def test_it_is_announced_where_others_may_come_in_and_not_from_a_container(
    announce: str, host: str, container: bool, expected: bool
) -> None:
    settings = Settings.model_validate({"announce": announce, "host": host})

    assert enabled(settings, in_container=container) is expected


@pytest.mark.parametrize("mark", [".dockerenv", "run/.containerenv"])
def test_a_container_is_known_by_its_files_and_variables(tmp_path: Path, mark: str) -> None:
    assert not inside_container({}, root=tmp_path)
    assert inside_container({"container": "podman"}, root=tmp_path)

    (tmp_path / mark).parent.mkdir(exist_ok=True)
    (tmp_path / mark).touch()

    assert inside_container({}, root=tmp_path)


def test_a_network_that_cannot_be_asked_is_logged_and_the_service_goes_on(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(**_: object) -> None:
        raise OSError(101, "Network is unreachable")

    monkeypatch.setattr(announcement, "AsyncZeroconf", fail)
    with serving("sim:wall", announce="on") as served:
        assert httpx.get(f"{served.url}/livez").status_code == 200
        wait_until(lambda: "not announced" in caplog.text)

    assert "Network is unreachable" in caplog.text


def test_a_service_for_every_client_reports_addresses_that_others_can_use() -> None:
    for host in ("0.0.0.0", "::"):
        reported = _addresses(host)
        assert reported
        assert not [each for each in reported if each.startswith("fe80") or each == "::1"]
    assert _addresses("192.168.7.5") == ["192.168.7.5"]


def test_a_name_fits_into_one_label_of_a_domain_name() -> None:
    assert _instance("AMCW 1.2 A-17") == "AMCW 1-2 A-17"
    assert len(_instance("ü" * 60).encode()) <= 63


def test_a_service_found_by_name_is_served_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: "Bench-2.lab.example")
    with serving("sim:wall", host="0.0.0.0", insecure=True, announce="off") as served:
        port = served.settings.port or served.url.rpartition(":")[2]
        answers = {
            name: httpx.get(
                f"http://127.0.0.1:{port}/livez", headers={"host": f"{name}:{port}"}
            ).status_code
            for name in ("bench-2.local", "bench-2", "bench-2.lab.example", "evil.example")
        }

    assert answers == {
        "bench-2.local": 200,
        "bench-2": 200,
        "bench-2.lab.example": 200,
        "evil.example": 403,
    }
