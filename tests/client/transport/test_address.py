"""Addresses of a daemon."""

import pytest

from transientcam.errors import ParameterError
from transientcam.transport import parse_address


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
