"""Who enters: host, origin and secret of a connection, each alone and all together."""

import socket

import pytest

from transientcam import ParameterError
from transientcam.admission import Admission, on_loopback

APP = "https://app.foxglove.dev"


def status(admission: Admission, path: str = "/", **headers: str) -> int | None:
    hosts = [headers.get("host", "127.0.0.1:8765")]
    origins = [headers["origin"]] if "origin" in headers else []
    refusal = admission.refusal(path, hosts=hosts, origins=origins)
    return None if refusal is None else refusal.status


@pytest.mark.parametrize("host", ["127.0.0.1", "::1", "[::1]", "localhost", "127.9.9.9"])
def test_what_serves_this_machine_alone_and_lends_no_right_has_no_secret(host: str) -> None:
    assert on_loopback(host)
    assert Admission.to(host, lends_right=False).path == ""
    assert len(Admission.to(host, lends_right=True).path) > 20


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.5", "camera.lab"])
def test_what_other_machines_reach_has_a_secret(host: str) -> None:
    assert not on_loopback(host)
    first, second = (Admission.to(host, lends_right=False).path for _ in range(2))
    assert first != second
    assert len(first) > 20


def test_the_address_names_a_host_that_can_be_connected_to() -> None:
    assert Admission.to("127.0.0.1", lends_right=True).host == "127.0.0.1"
    assert Admission.to("::1", lends_right=True).host == "[::1]"
    assert Admission.to("0.0.0.0", lends_right=True).host == socket.gethostname()
    assert Admission.to("camera.lab", lends_right=True).host == "camera.lab"


def test_only_the_secret_opens() -> None:
    door = Admission("127.0.0.1", secret="s3cret")
    assert status(door, "/s3cret") is None
    assert status(door, "/s3cret?from=foxglove") is None
    for path in ("/", "", "/s3cre", "/s3crets", "/S3CRET", "/x/s3cret", "/s3cret/", "/?s3cret"):
        assert status(door, path) == 401, path
    assert status(door, "/s3cret\udcff") == 401


@pytest.mark.parametrize(
    "origin",
    [
        "https://evil.example",
        "null",
        "file://",
        "",
        "http://127.0.0.1:8000",
        "http://127.0.0.1:8765",
        "https://app.foxglove.dev.evil.example",
        "http://app.foxglove.dev",
        "https://app.foxglove.dev:444",
    ],
)
def test_no_page_enters_but_those_that_are_named(origin: str) -> None:
    assert status(Admission("127.0.0.1", secret=None), origin=origin) == 403
    door = Admission("127.0.0.1", secret="s", origins=[APP])
    assert status(door, "/s", origin=origin) == 403
    assert status(door, "/s", origin=APP) is None
    assert status(door, "/", origin=APP) == 401


def test_two_headers_of_one_name_do_not_enter() -> None:
    door = Admission("127.0.0.1", secret=None, origins=[APP])
    here = ["127.0.0.1"]
    for hosts, origins in ((here, [APP, APP]), ([], []), (here * 2, []), (here, ["", APP])):
        assert door.refusal("/", hosts=hosts, origins=origins) is not None


@pytest.mark.parametrize("name", ["evil.example", "127.0.0.1.evil.example", "", "[", "192.168.1.5"])
def test_a_name_bound_to_this_address_by_somebody_else_does_not_enter(name: str) -> None:
    assert status(Admission("127.0.0.1", secret=None), host=name) == 421


@pytest.mark.parametrize("name", ["192.168.1.5:80", "[fe80::1]:80", "localhost", "LOCALHOST:1"])
def test_what_others_reach_is_called_by_any_of_its_addresses(name: str) -> None:
    door = Admission("0.0.0.0", secret=None)
    assert status(door, host=name) is None
    assert status(door, host=socket.gethostname()) is None
    assert status(door, host="evil.example") == 421


@pytest.mark.parametrize("origin", ["app.foxglove.dev", "", "https://a.b/c", "https://u@a.b", "*"])
def test_what_is_no_origin_is_refused_by_name(origin: str) -> None:
    with pytest.raises(ParameterError, match="origin is"):
        Admission("127.0.0.1", secret=None, origins=[origin])
