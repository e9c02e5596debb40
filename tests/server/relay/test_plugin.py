"""How a relay's name is read, and origins that cannot be relayed."""

import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

from transientcam_driver import CameraLost, CameraName, SpecError
from transientcam_driver.camera import Hop
from transientcam_server.relay import PLUGIN, Origin, RelayCamera
from transientcam_server.relay._reports import hops_of, lost_at_origin


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("relay:", "names no service"),
        ("relay:ftp://lab:8000", "ftp"),
        ("relay:http://lab:8000?product=coefficients", "measured_moments takes"),
        ("relay:http://lab:8000?product=range", "raw, measured_moments"),
        ("relay:http://lab:8000?token_file=/nowhere/token", "token_file cannot be read"),
        ("relay:http://lab:8000?timeout_s=0", "timeout_s"),
    ],
)
def test_a_name_that_cannot_be_used_is_refused_with_the_part(name: str, reason: str) -> None:
    with pytest.raises(SpecError, match=reason):
        PLUGIN.check(CameraName.parse(name))


def test_an_empty_token_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "token").write_text("\n", encoding="utf-8")
    with pytest.raises(SpecError, match="is empty"):
        PLUGIN.check(CameraName.parse(f"relay:http://lab?token_file={tmp_path / 'token'}"))


def test_a_secret_in_the_address_is_refused_and_not_repeated() -> None:
    with pytest.raises(SpecError, match="token_file") as refused:
        PLUGIN.check(CameraName.parse("relay:http://user:secret@lab:8000"))
    assert "secret" not in str(refused.value)


class _Older(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        body = b'{"name": "transientcam", "version": "0.1.0", "caller": {"role": "admin"}}'
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 - as its base has it
        pass


@pytest.fixture
def older() -> Iterator[str]:
    with HTTPServer(("127.0.0.1", 0), _Older) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


def test_an_older_origin_is_refused_with_its_version(older: str) -> None:
    origin = Origin(older, None, timeout_s=60.0)
    with pytest.raises(CameraLost, match=r"0\.1\.0.*service_id.*update it"):
        RelayCamera(origin)


def test_each_hop_counts_from_the_arrival_at_the_one_before() -> None:
    first = {"service_id": "a", "latency_s": 0.25, "missed_frames": 3}
    meta = {"host_time_s": 1000.0, "hops": [first]}
    found = hops_of(meta, service_id="b", now_unix_s=1001.0, missed_frames=1)  # type: ignore[arg-type]
    assert found == (Hop("a", 0.25, 3), Hop("b", 0.75, 1))


def test_the_reason_of_a_loss_is_said_once_by_a_chain_of_relays() -> None:
    reason = str(CameraLost("it is disconnected"))

    for _ in range(3):
        reason = str(CameraLost(lost_at_origin(reason)))

    sentence = "the camera was lost: the origin has lost its camera: it is disconnected"
    assert reason == sentence
