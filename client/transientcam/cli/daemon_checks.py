"""The checks of ``transientcam doctor URL``: a daemon, as a client sees it."""

import json
import ssl
import time
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from email.utils import parsedate_to_datetime
from importlib.metadata import version
from statistics import median
from typing import Any, Final

import httpx

from transientcam.camera import Camera
from transientcam.cli.findings import Finding, absent_in_words
from transientcam.errors import FrameTimeout, ProblemError, TransientcamError
from transientcam.requests import MOST_DOCUMENT_BYTES
from transientcam.robotics import Pinhole
from transientcam.transport import bounded, http_client, parse_address, read, translated, within

CLOCKS_WITHIN_S: Final = 1.5
"""The daemon's ``Date`` has whole seconds, so that nothing finer can be measured."""
KEEPS_UP: Final = 0.9
"""Share of the camera's frames that should arrive."""
CERTIFICATE_RENEWED: Final = timedelta(days=14)
"""How long before its end a certificate should have been renewed."""
_PRODUCT = "range"
_FIRST_FRAME_S = 10.0


def of_daemon(
    url: str, *, token: str | None, seconds: float, timeout_s: float
) -> Iterator[Finding]:
    """Check a daemon, and watch its stream for some seconds."""
    base = parse_address(url).url
    with bounded(http_client(httpx.Client, token=token, timeout_s=timeout_s)) as http:
        try:
            with translated(base), within(timeout_s):
                sent_s = time.time()
                with http.stream("GET", f"{base}/api/versions") as response:
                    body = read(response, most_bytes=MOST_DOCUMENT_BYTES).body
                    # the connection is to be had only while the answer is open
                    ends = _certificate_ends(response)
                answered_s = time.time()
            found = json.loads(body) if response.status_code == httpx.codes.OK else None
        except (TransientcamError, ValueError, RecursionError) as error:
            remedy = "is `transientcam serve` running there, and does a firewall let you through?"
            yield Finding("fault", "reachable", str(error), remedy)
            return
        if not isinstance(found, dict) or found.get("name") != "transientcam":
            message = f"what answers at {base} is no transientcam (status {response.status_code})"
            yield Finding("fault", "reachable", message, "check the address and its port")
            return
        took_ms = (answered_s - sent_s) * 1e3
        yield Finding("ok", "reachable", f"{base} answered within {took_ms:.0f} ms")
        if ends is not None:
            yield _certificate(ends, now=datetime.now(UTC))
        yield _versions(found)
        yield _ready(http, base, timeout_s=timeout_s)
        yield _clock(response.headers.get("date"), sent_s, answered_s)
    try:
        with Camera(base, token=token, timeout_s=timeout_s) as camera:
            yield from _camera(camera, seconds)
    except ProblemError as error:
        yield Finding("fault", "access", str(error), _remedy_of(error))
    except TransientcamError as error:
        yield Finding("fault", "stream", str(error), "look into the daemon's log")


def _certificate_ends(response: httpx.Response) -> datetime | None:
    """Return until when the daemon's certificate is valid; None without TLS."""
    connection = response.extensions.get("network_stream")
    encrypted = None if connection is None else connection.get_extra_info("ssl_object")
    certificate = None if encrypted is None else encrypted.getpeercert()
    if not certificate:
        return None
    return datetime.fromtimestamp(ssl.cert_time_to_seconds(certificate["notAfter"]), UTC)


def _certificate(ends: datetime, *, now: datetime) -> Finding:
    left = ends - now
    message = f"trusted, and valid until {ends:%Y-%m-%d}"
    if left < CERTIFICATE_RENEWED:
        return Finding("warning", "certificate", message, f"renew it: {left.days} days are left")
    return Finding("ok", "certificate", message)


def _versions(found: dict[str, Any]) -> Finding:
    here, there = version("transientcam"), found.get("version")
    served = [each.get("name") for each in found.get("api", ())]
    if "v1" not in served:
        message = f"it serves the interfaces {served}, this client speaks v1"
        return Finding("fault", "versions", message, "install the same version on both sides")
    if here != there:
        message = f"the daemon is {there}, this client {here}"
        return Finding("warning", "versions", message, "install the same version on both sides")
    return Finding("ok", "versions", f"both are {here}")


def _ready(http: httpx.Client, base: str, *, timeout_s: float) -> Finding:
    try:
        with translated(base), within(timeout_s), http.stream("GET", f"{base}/readyz") as response:
            body = read(response, most_bytes=MOST_DOCUMENT_BYTES).body
    except TransientcamError as error:
        return Finding("fault", "ready", str(error), "look into the daemon's log")
    if response.status_code == httpx.codes.OK:
        return Finding("ok", "ready", "frames can be had")
    try:
        why = str(json.loads(body)["detail"])
    except (ValueError, KeyError, TypeError, RecursionError):
        why = f"status {response.status_code}"
    return Finding("fault", "ready", why, "is the camera plugged in? Its daemon's log says more")


def _clock(date: str | None, sent_s: float, answered_s: float) -> Finding:
    """Compare the daemon's clock, which has whole seconds, with this one."""
    try:
        there_s = parsedate_to_datetime(date or "").replace(tzinfo=UTC).timestamp()
    except ValueError:
        return Finding("warning", "clock", "the daemon does not say what time it is")
    # it was within the second that the header names, between request and answer
    behind_s = max(0.0, sent_s - (there_s + 1.0))
    ahead_s = max(0.0, there_s - answered_s)
    apart_s = ahead_s or -behind_s
    if abs(apart_s) > CLOCKS_WITHIN_S:
        ahead = "ahead of" if apart_s > 0.0 else "behind"
        now = datetime.fromtimestamp(there_s, UTC)
        message = f"the daemon's is {abs(apart_s):.0f} s {ahead} this one ({now:%H:%M:%S} UTC)"
        return Finding("warning", "clock", message, "let NTP set both; until then latencies lie")
    return Finding("ok", "clock", "the daemon's agrees with this one within a second")


def _camera(camera: Camera, seconds: float) -> Iterator[Finding]:
    about = camera.camera
    capabilities = about["capabilities"]
    name = f"{capabilities['model']}, serial number {capabilities['serial']}, {about['state']}"
    if about["state"] == "lost":
        yield Finding("fault", "camera", f"{name}: {about['reason']}", "plug it in again")
        return
    yield Finding("ok", "camera", name)
    if (warning := about.get("light_warning")) is not None:  # older daemons say nothing of it
        remedy = "docs/operations.md says what switches the light off, and after how long"
        yield Finding("warning", "light", warning, remedy)
    if (strange := Pinhole.of_document(about["intrinsics"]).off_the_image) is not None:
        yield Finding("warning", "lens", strange, "set [lens] for the resolution of this camera")
    active = camera.calibrations.active()
    if (warning := active.get("warning")) is not None:
        yield Finding("warning", "calibration", str(warning), "transientcam calibrate")
    if (absent := camera.info.get("absent_products")) is not None:  # older daemons do not say
        for message in absent_in_words({each["name"]: each["reason"] for each in absent}):
            yield Finding("ok", "products", message)
    if not camera.acquisition["running"]:
        message = "the capture is stopped, so nothing can be measured"
        remedy = 'PUT /api/v1/acquisition {"running": true} starts it'
        yield Finding("warning", "stream", message, remedy)
        return
    yield _stream(camera, seconds)


def _stream(camera: Camera, seconds: float) -> Finding:
    latencies_s: list[float] = []
    numbers: list[int] = []
    size = 0
    with camera.stream(_PRODUCT, reconnect=False) as stream:
        try:
            stream.receive(timeout_s=_FIRST_FRAME_S)
        except FrameTimeout as error:
            return Finding("fault", "stream", str(error), "look at /readyz and the daemon's log")
        started_s = time.monotonic()
        while (left_s := started_s + seconds - time.monotonic()) > 0.0:
            try:
                frame = stream.receive(timeout_s=left_s)
            except FrameTimeout:
                break
            latencies_s.append(time.time() - float(frame.meta["host_time_s"]))
            numbers.append(frame.frame)
            size += frame.array.nbytes
        took_s = time.monotonic() - started_s
        expected_hz = float(stream.sequence["frame_rate_hz"])
    if not numbers:
        message = f"no second frame within {seconds:g} s, at {expected_hz:.3g} Hz"
        return Finding("warning", "stream", message, "watch for longer: --seconds")
    missed = numbers[-1] - numbers[0] + 1 - len(numbers)
    message = (
        f"{_PRODUCT} at {len(numbers) / took_s:.1f} Hz of the camera's {expected_hz:.1f}, "
        f"{size / took_s / 1e6:.1f} MB/s, {median(latencies_s) * 1e3:.0f} ms old on arrival, "
        f"{missed} frames missed"
    )
    if len(numbers) < KEEPS_UP * expected_hz * took_s - 1.0:
        remedy = (
            "is the network fast enough, or the daemon's machine? A lower max_rate_hz, a region or "
            "a decimation reduces the load"
        )
        return Finding("warning", "stream", message, remedy)
    return Finding("ok", "stream", message)


def _remedy_of(error: ProblemError) -> str:
    if error.status in (httpx.codes.UNAUTHORIZED, httpx.codes.FORBIDDEN):
        return (
            "give a token: --token, or TRANSIENTCAM_TOKEN (`transientcam token create` makes one)"
        )
    return "look into the daemon's log"
