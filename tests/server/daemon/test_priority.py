"""Which requests switch the light off, wherever they are cut."""

import pytest

from transientcam_server.daemon._priority import MOST_BYTES, switches_off

HOST = b"Host: lab:8000\r\n"
SAFE_OFF = b"POST /api/v1/acquisition/safe-off HTTP/1.1\r\n" + HOST
BACK = b"DELETE /api/v1/lease HTTP/1.1\r\n" + HOST
SET = b"PUT /api/v1/acquisition HTTP/1.1\r\n" + HOST


def with_body(head: bytes, body: bytes, *, length: bytes = b"Content-Length") -> bytes:
    return head + length + b": %d\r\n\r\n" % len(body) + body


@pytest.mark.parametrize(
    "request_",
    [
        SAFE_OFF + b"\r\n",
        SAFE_OFF + b"Authorization: Bearer tcam_0123_abc\r\n\r\n",
        b"\r\n" + SAFE_OFF + b"\r\n",
        SAFE_OFF.replace(b"1.1", b"1.0") + b"\r\n",
        SAFE_OFF.replace(b" HTTP", b"?from=page HTTP") + b"\r\n",
        SAFE_OFF.replace(b" /api", b" http://lab:8000/api") + b"\r\n",
        SAFE_OFF.replace(b" /api", b" /of/a-proxy/api") + b"\r\n",
        SET.replace(b" /api", b" http://lab/lidar/api")
        + b'Content-Length: 17\r\n\r\n{"running":false}',
        with_body(SAFE_OFF, b"{}"),
        BACK + b"Transientcam-Lease: secret\r\n\r\n",
        with_body(SET, b'{"running": false}'),
        with_body(SET, b'{"running":false}\n', length=b"content-length"),
    ],
)
def test_they_do_once_they_are_complete_and_not_before(request_: bytes) -> None:
    for end in range(1, len(request_)):
        assert switches_off(request_[:end]) is None
    assert switches_off(request_) is True
    assert switches_off(request_ + b"GET / HTTP/1.1\r\n") is True


@pytest.mark.parametrize(
    "request_",
    [
        b"GET /livez HTTP/1.1\r\n",
        b"\x16\x03\x01",
        b"POST /api/v1/acquisition/safe-offs HTTP/1.1\r\n",
        b"POST /api/v1/acquisition/safe-off\r\n",
        b"POST /x?/api/v1/acquisition/safe-off HTTP/1.1\r\n",
        b"GET /api/v1/acquisition/safe-off HTTP/1.1\r\n",
        b"DELETE /api/v1/recordings/1 HTTP/1.1\r\n",
        b"POST /api/v1/lease HTTP/1.1\r\n",
        b"PUT /api/v1/lease HTTP/1.1\r\n",
        with_body(SET, b'{"running": true}'),
        with_body(SET, b'{"running": 0}'),
        with_body(SET, b"[false]"),
        with_body(SET, b"running"),
        SET + b"\r\n",
        SAFE_OFF + b"Transfer-Encoding: chunked\r\n\r\n",
        SAFE_OFF + b"Content-Length: 100000\r\n\r\n",
        SAFE_OFF + b"Content-Length: -1\r\n\r\n",
        SAFE_OFF + b"x: " + b"x" * MOST_BYTES,
        b"POST http" + b"x" * MOST_BYTES,
    ],
)
def test_all_others_do_not(request_: bytes) -> None:
    assert switches_off(request_) is False
