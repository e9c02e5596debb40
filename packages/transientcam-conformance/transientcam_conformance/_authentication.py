"""Tokens, where the service requires them: no access without, and none is taken from a URL."""

from typing import Any

from transientcam.errors import PromiseBroken
from transientcam.wire import CloseCode
from transientcam_conformance._device import API, Device
from transientcam_conformance._expecting import equal, expect, skip_unless

_WRONG = "tc_unknown"
_ANONYMOUS = {"authorization": ""}


def health_is_open(device: Device) -> None:
    """/livez and /readyz answer without a token, for service managers."""
    for path in ("/livez", "/readyz"):
        response = device.send("GET", path, headers=_ANONYMOUS)
        expect(response.status_code in (200, 503), f"{path} gives {response.status_code}")


def a_wrong_token_is_refused(device: Device) -> None:
    """A token that is not valid is refused with 401, also where none is required."""
    for header in ({"authorization": f"Bearer {_WRONG}"}, {"x-api-key": _WRONG, **_ANONYMOUS}):
        response = device.send("GET", f"{API}/info", headers=header)
        device.refusal(response, 401, "token-refused")
        expect(response.headers.get("www-authenticate"), "the refusal has no WWW-Authenticate")


def a_stream_with_a_wrong_token_is_closed(device: Device) -> None:
    """A subscription with a token that is not valid ends the stream with the close code 4003."""
    with device.stream(silent=True) as stream:
        stream.send(_subscribe(_WRONG))
        equal(stream.close_code(), CloseCode.AUTHENTICATION_FAILED, "the close code")


def no_request_is_served_without_a_token(device: Device) -> None:
    """Where tokens are required, all of the camera is refused with 401 without one."""
    _require_tokens(device)
    for path in (f"{API}/camera", f"{API}/sequence", f"{API}/frames/latest/range", "/metrics"):
        device.refusal(device.send("GET", path, headers=_ANONYMOUS), 401, "token-required")
    with device.stream(silent=True) as stream:
        stream.send(_subscribe(None))
        equal(stream.close_code(), CloseCode.AUTHENTICATION_FAILED, "the close code")


def a_token_in_the_address_is_none(device: Device) -> None:
    """A token in a query is none: addresses are logged and shared."""
    _require_tokens(device)
    for name in ("token", "access_token", "api_key"):
        response = device.send(
            "GET", f"{API}/info", headers=_ANONYMOUS, params={name: device.token or _WRONG}
        )
        device.refusal(response, 401, "token-required")


def the_token_given_is_let_in(device: Device) -> None:
    """A valid token lets in, in Authorization and in X-API-Key alike."""
    _require_tokens(device)
    if device.token is None:
        raise PromiseBroken("the service requires a token: give one with --token")
    device.read(f"{API}/info")
    device.read(f"{API}/info", headers={**_ANONYMOUS, "x-api-key": device.token})


def _require_tokens(device: Device) -> None:
    response = device.send("GET", f"{API}/info", headers=_ANONYMOUS)
    skip_unless(response.status_code == 401, "the service requires no token")


def _subscribe(token: str | None) -> dict[str, Any]:
    subscriptions = [{"product": "flags"}]
    return {"type": "subscribe", "v": 1, "token": token, "subscriptions": subscriptions}
