"""Addresses of a daemon."""

import pytest

from transientcam import Camera
from transientcam.errors import ParameterError, TransientcamError
from transientcam.transport import parse_address, without_secrets


@pytest.mark.parametrize(
    ("given", "url", "stream"),
    [
        ("http://127.0.0.1:8000", "http://127.0.0.1:8000", "ws://127.0.0.1:8000/api/v1/stream"),
        ("http://127.0.0.1:8000/", "http://127.0.0.1:8000", "ws://127.0.0.1:8000/api/v1/stream"),
        ("localhost:8000", "http://localhost:8000", "ws://localhost:8000/api/v1/stream"),
        ("lidar.example", "http://lidar.example", "ws://lidar.example/api/v1/stream"),
        (
            "https://lab.example/left/",
            "https://lab.example/left",
            "wss://lab.example/left/api/v1/stream",
        ),
        ("http://[::1]:8000", "http://[::1]:8000", "ws://[::1]:8000/api/v1/stream"),
    ],
)
def test_an_address_serves_requests_and_streams(given: str, url: str, stream: str) -> None:
    address = parse_address(given)

    assert (address.url, address.stream) == (url, stream)
    assert address.api == f"{url}/api/v1"


@pytest.mark.parametrize(
    "given",
    [
        "",
        "ftp://host",
        "http://",
        "http://host:port",
        "http://host:99999",
        "http://h?x=1",
        "http://h#x",
        "ws://h",
    ],
)
def test_what_is_no_address_is_refused(given: str) -> None:
    with pytest.raises(ParameterError, match=r"url is .* but must be an address like http://"):
        parse_address(given)


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ("http://me:s3cret@lab:8000/left", "http://lab:8000/left"),
        ("me:s3cret@lab", "lab"),
        ("http://me:s3@cret@lab", "http://lab"),
        ("ftp://me:s3cret@lab?token=s3cret#s3cret", "ftp://lab"),
        ("http://lab:8000?token=s3cret", "http://lab:8000"),
        ("http://lab/a@b", "http://lab/a@b"),
        ("http://[::1]:8000", "http://[::1]:8000"),
        ("", ""),
    ],
)
def test_what_is_secret_in_an_address_is_not_shown(given: str, shown: str) -> None:
    assert without_secrets(given) == shown


@pytest.mark.parametrize("url", ["http://me:s3cret@127.0.0.1:1", "ftp://s3cret@h", "h?t=s3cret"])
def test_no_error_and_no_representation_has_it(url: str) -> None:
    def ask() -> None:
        with Camera(url, timeout_s=1.0) as camera:
            assert "s3cret" not in repr(camera) + camera.url
            _ = camera.info

    with pytest.raises(TransientcamError) as refused:
        ask()
    assert "s3cret" not in str(refused.value) + repr(refused.value)
