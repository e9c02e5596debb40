"""Cameras that announce themselves on the local network (mDNS, DNS-SD: RFC 6762, RFC 6763).

::

    for found in transientcam.discover():
        print(found.name, found.url)

A camera announces itself as ``_transientcam._tcp``, and for browsers as ``_http._tcp``, with a TXT
record of five keys: ``path`` (where its page is), ``api`` (the versions of the interface), ``sn``
and ``fw`` (serial number and firmware of the camera), ``tls`` (1 where it is https).
"""

import ipaddress
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, cast

from transientcam.errors import ParameterError
from transientcam.transport import translated

if TYPE_CHECKING:
    from zeroconf import ServiceInfo, ServiceListener, Zeroconf

SERVICE_TYPE: Final = "_transientcam._tcp.local."
WEB_TYPE: Final = "_http._tcp.local."
_PLACE: Final = "the local network"


@dataclass(frozen=True, slots=True)
class FoundCamera:
    """A camera's daemon, as it announces itself; no request was sent to it yet.

    Attributes
    ----------
    name
        Its name, unique on this network.
    url
        Its address; what `Camera` takes.
    serial, firmware
        Of the camera; empty where they are not announced.
    api
        Versions of the interface, such as ``v1``.
    tls
        Whether it is https.
    """

    name: str
    url: str
    serial: str
    firmware: str
    api: str
    tls: bool


def discover(
    *, timeout_s: float = 2.0, interfaces: Sequence[str] | None = None
) -> tuple[FoundCamera, ...]:
    """Return the cameras that answer within ``timeout_s``, by name.

    Parameters
    ----------
    timeout_s
        How long to listen; all of it is used.
    interfaces
        Addresses of the network interfaces to search on; all of this machine without them.

    Raises
    ------
    ServerUnreachable
        If the network cannot be searched.
    ModuleNotFoundError
        If zeroconf is not installed: ``pip install 'transientcam[discovery]'``.
    """
    from zeroconf import InterfaceChoice, ServiceBrowser, Zeroconf

    if not timeout_s > 0.0:
        raise ParameterError("timeout_s", timeout_s, "above 0")
    for each in interfaces or ():
        _require_address(each)
    found: dict[str, FoundCamera] = {}
    ends_s = time.monotonic() + timeout_s
    with translated(_PLACE):
        searched = list(interfaces) if interfaces else InterfaceChoice.All
        network = Zeroconf(interfaces=searched)
        try:
            # its base class is empty, and only there where zeroconf is installed
            names = cast("ServiceListener", _Names(network, ends_s, found))
            browser = ServiceBrowser(network, SERVICE_TYPE, listener=names)
            time.sleep(timeout_s)
            browser.cancel()
        finally:
            network.close()
    return tuple(found[name] for name in sorted(found))


def _require_address(text: str) -> None:
    try:
        ipaddress.ip_address(text)
    except ValueError as error:
        limit = "the address of a network interface, such as 192.168.1.5"
        raise ParameterError("interfaces", text, limit) from error


class _Names:
    """Listens for names, and resolves each to an address."""

    def __init__(self, network: "Zeroconf", ends_s: float, found: dict[str, FoundCamera]) -> None:
        self._network = network
        self._ends_s = ends_s
        self._found = found

    def add_service(self, zc: "Zeroconf", type_: str, name: str) -> None:
        left_ms = round((self._ends_s - time.monotonic()) * 1e3)
        info = self._network.get_service_info(type_, name, timeout=max(1, left_ms))
        camera = None if info is None else read_announcement(info)
        if camera is not None:
            self._found[name] = camera

    update_service = add_service

    def remove_service(self, zc: "Zeroconf", type_: str, name: str) -> None:
        self._found.pop(name, None)


def read_announcement(info: "ServiceInfo") -> FoundCamera | None:
    """Return the camera that an announcement names; None where it names no address.

    Any host on the network may have sent it, so none of it is trusted.
    """
    host = _host_of(info)
    if host is None or not info.port:
        return None
    text = {key: _printable(value) for key, value in info.decoded_properties.items()}
    tls = text.get("tls") == "1"
    if tls and info.server:
        host = info.server.rstrip(".")  # what its certificate names
    path = text.get("path", "/")
    scheme = "https" if tls else "http"
    return FoundCamera(
        name=_printable(info.get_name()),
        url=f"{scheme}://{host}:{info.port}{path if path.startswith('/') else ''}".rstrip("/"),
        serial=text.get("sn", ""),
        firmware=text.get("fw", ""),
        api=text.get("api", ""),
        tls=tls,
    )


def _host_of(info: "ServiceInfo") -> str | None:
    """Return the address that is most likely to be reached, as it stands in a URL."""
    addresses = info.parsed_scoped_addresses()
    four = [each for each in addresses if ":" not in each]
    if four:
        return four[0]
    # RFC 6874: the percent sign before a zone is escaped
    return f"[{addresses[0].replace('%', '%25')}]" if addresses else None


def _printable(text: str | None) -> str:
    return "".join(each for each in text or "" if each.isprintable())
