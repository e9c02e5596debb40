"""The preview: motion JPEG, for as long as a viewer is connected."""

import io
import socket
import time
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

import httpx
import numpy as np
import pytest
from PIL import Image

from tests.serving import Served, serving

PREVIEW = "/api/v1/preview.mjpeg"
PATIENCE_S = 60.0


def parts(response: httpx.Response) -> Iterator[tuple[dict[str, str], bytes]]:
    """Read a multipart body part by part, as RFC 2046 says."""
    boundary = response.headers["content-type"].partition("boundary=")[2]
    delimiter = f"--{boundary}\r\n".encode()
    data = b""
    for piece in response.iter_raw():
        data += piece
        while data.count(delimiter) > 1:
            _, part, rest = data.split(delimiter, 2)
            data = delimiter + rest
            head, _, body = part.partition(b"\r\n\r\n")
            headers = dict(line.split(": ", 1) for line in head.decode("ascii").split("\r\n"))
            assert body.endswith(b"\r\n")
            yield headers, body[:-2]


@pytest.fixture
def http(served: Served) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=served.url, timeout=60.0) as client:
        yield client


def nobody_looks(served: Served) -> bool:
    until_s = time.monotonic() + PATIENCE_S
    while served.service.mjpeg_clients and time.monotonic() < until_s:
        time.sleep(0.01)
    return served.service.mjpeg_clients == 0


def test_every_part_is_a_picture_of_a_later_frame(served: Served, http: httpx.Client) -> None:
    with http.stream("GET", PREVIEW, params={"product": "range"}) as response:
        assert response.status_code == 200
        assert response.headers["content-type"].startswith("multipart/x-mixed-replace")
        film = parts(response)
        seen = [next(film) for _ in range(4)]
        assert served.service.mjpeg_clients == 1

    numbers = [int(headers["Transientcam-Frame"]) for headers, _ in seen]
    assert (np.diff(numbers) > 0).all()
    for headers, body in seen:
        assert headers["Content-Type"] == "image/jpeg"
        assert int(headers["Content-Length"]) == len(body)
        picture = Image.open(io.BytesIO(body))
        assert (picture.format, picture.size) == ("JPEG", (163, 120))
        assert np.asarray(picture).std() > 10.0
    assert nobody_looks(served)


def test_it_ends_after_as_many_pictures_as_were_asked_for(http: httpx.Client) -> None:
    response = http.get(PREVIEW, params={"product": "brightness", "frames": 2})

    assert response.content.count(b"Content-Type: image/jpeg") == 2


def test_a_rate_leaves_frames_out(http: httpx.Client) -> None:
    response = http.get(PREVIEW, params={"max_rate_hz": 3.0, "frames": 4})

    lines = response.content.split(b"\r\n")
    numbers = [int(each.split()[1]) for each in lines if each.startswith(b"Transientcam-Frame")]
    times_s = [http.get(f"/api/v1/frames/{each}").json()["device_time_s"] for each in numbers]
    assert len(times_s) == 4
    # by the camera's clock, so that frames which a laden machine does not capture do not count
    assert (np.subtract(times_s, times_s[0]) > (np.arange(4) - 0.11) / 3.0).all()


def test_a_viewer_that_does_not_read_delays_no_other_and_has_nothing_made_ahead(
    served: Served, http: httpx.Client
) -> None:
    address = urlsplit(served.url)
    with socket.create_connection((address.hostname, address.port)) as stuck:
        stuck.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        stuck.sendall(f"GET {PREVIEW} HTTP/1.1\r\nHost: {address.netloc}\r\n\r\n".encode())
        response = http.get(PREVIEW, params={"frames": 12})
        assert response.content.count(b"Content-Type: image/jpeg") == 12
    assert nobody_looks(served)


def test_a_viewer_that_leaves_while_the_capture_is_stopped_is_noticed_at_once(
    served: Served, http: httpx.Client
) -> None:
    with http.stream("GET", PREVIEW) as response:
        film = parts(response)
        next(film)
        httpx.put(f"{served.url}/api/v1/acquisition", json={"running": False})

    assert nobody_looks(served)


def test_a_film_ends_with_the_service() -> None:
    with serving("sim:mirrors?noise=off") as daemon:
        client = httpx.Client(base_url=daemon.url, timeout=60.0)
        request = client.build_request("GET", PREVIEW)
        response = client.send(request, stream=True)
        film = parts(response)
        next(film)

    for _ in film:  # what was on its way; then the end
        pass
    client.close()


def test_viewers_of_the_preview_count_among_the_clients_of_the_stream() -> None:
    with (
        serving("sim:mirrors?noise=off", stream={"max_clients": 1}) as daemon,
        httpx.Client(base_url=daemon.url, timeout=60.0) as http,
    ):
        with http.stream("GET", PREVIEW) as response:
            film = parts(response)  # held, or the response is closed
            next(film)
            refused = httpx.get(f"{daemon.url}{PREVIEW}", params={"frames": 1})
            samples = httpx.get(f"{daemon.url}/metrics").text
        assert nobody_looks(daemon)

    assert (refused.status_code, refused.json()["type"]) == (503, "/problems/too-many-clients")
    assert "transientcam_preview_clients 1.0" in samples


def test_head_ends_although_the_film_would_not(http: httpx.Client) -> None:
    response = http.head(PREVIEW)

    assert response.status_code == 200
    assert response.headers["content-type"].startswith("multipart/x-mixed-replace")
    assert http.get("/livez").status_code == 200  # on the same connection


@pytest.mark.parametrize(
    ("query", "status", "slug"),
    [
        ({"product": "nothing"}, 404, "unknown-product"),
        ({"product": "raw"}, 406, "not-acceptable"),
        ({"product": "streak"}, 406, "not-acceptable"),
        ({"max_rate_hz": 0}, 422, "invalid-request"),
        ({"max_rate_hz": "inf"}, 422, "invalid-request"),
        ({"frames": 0}, 422, "invalid-request"),
    ],
)
def test_what_cannot_be_shown_is_refused(
    http: httpx.Client, query: dict[str, Any], status: int, slug: str
) -> None:
    response = http.get(PREVIEW, params=query)

    assert (response.status_code, response.json()["type"]) == (status, f"/problems/{slug}")
