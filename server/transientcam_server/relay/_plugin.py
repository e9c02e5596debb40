"""The plug-in ``relay``: the camera of another service."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from transientcam import ParameterError
from transientcam.transport import parse_address
from transientcam_driver import Camera, CameraName, CameraPlugin, SpecError
from transientcam_driver.clock import Clock
from transientcam_driver.texts import read_text
from transientcam_server.relay._camera import RelayCamera
from transientcam_server.relay._frames import SUBSCRIBED
from transientcam_server.relay._origin import Origin

TOKEN_VARIABLE: Final = "TRANSIENTCAM_RELAY_TOKEN"  # noqa: S105 - the name of a variable
TIMEOUT_S: Final = 10.0


def _address(name: CameraName) -> str:
    """Read what is relayed, without reaching for it.

    Raises SpecError naming the part that is not valid.
    """
    if name.options.get("product") == "coefficients":
        reason = (
            "product = 'coefficients': must be raw or measured_moments: coefficients come behind "
            "smoothing and biasing, which the likelihood and the flags are computed without; "
            "measured_moments takes about as many bytes, and everything but images is computed of "
            "it"
        )
        raise SpecError(name.spec, reason)
    name.choice("product", tuple(SUBSCRIBED))
    if not name.address:
        raise SpecError(name.spec, "it names no service, as in relay:http://lab:8000")
    try:
        address = parse_address(name.address)
    except ParameterError as error:
        raise SpecError(name.spec, str(error)) from error
    if "@" in address.url.partition("://")[2].partition("/")[0]:
        raise SpecError(name.kind, "a token does not stand in an address: use token_file")
    return address.url


def _token(name: CameraName, environment: Mapping[str, str]) -> str | None:
    """Read the token of the origin: a file goes before the environment.

    Raises SpecError where the file cannot be read, or holds nothing.
    """
    path = name.options.get("token_file")
    if path is None:
        return environment.get(TOKEN_VARIABLE) or None
    try:
        token = read_text(Path(path)).strip()
    except (OSError, ValueError) as error:
        raise SpecError(name.spec, f"token_file cannot be read: {error}") from error
    if not token:
        raise SpecError(name.spec, f"token_file {path} is empty")
    return token


def uses_token(spec: str, environment: Mapping[str, str]) -> bool:
    """Return whether a camera is a relay that shows its origin a token."""
    try:
        name = CameraName.parse(spec)
        return name.kind == "relay" and _token(name, environment) is not None
    except SpecError:  # it says so itself when it is opened
        return False


def _open(name: CameraName, clock: Clock) -> Camera:
    url, token = _address(name), _token(name, os.environ)
    origin = Origin(
        url,
        token,
        timeout_s=name.number("timeout_s", TIMEOUT_S, least=0.1, most=600.0),
        product=name.choice("product", tuple(SUBSCRIBED)),
    )
    return RelayCamera(origin, clock=clock)


def _check(name: CameraName) -> None:
    _address(name)
    _token(name, os.environ)
    name.number("timeout_s", TIMEOUT_S, least=0.1, most=600.0)


PLUGIN: Final = CameraPlugin(
    summary="the camera of another service, served again (docs/relay.md)",
    usage="relay:http://HOST:PORT",
    open=_open,
    check=_check,
    options={
        "product": "raw, or measured_moments: fewer bytes of several takes, and no images",
        "token_file": f"a file with the origin's token; without it {TOKEN_VARIABLE}",
        "timeout_s": f"for each answer of the origin, {TIMEOUT_S:g} s without it",
    },
)
