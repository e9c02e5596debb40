"""Cameras that announce themselves on the local network (mDNS, DNS-SD: RFC 6762, RFC 6763).

::

    for found in transientcam.discover():
        print(found.name, found.url)

A camera announces itself as ``_transientcam._tcp``, and for browsers as ``_http._tcp``, with a TXT
record of seven keys: ``path`` (where its page is), ``api`` (the versions of the interface),
``model``, ``sn`` and ``fw`` (model, serial number and firmware of the camera), ``state`` (what it
does, one of `STATES`), ``tls`` (1 where it is https).
"""

import asyncio
import ipaddress
import re
import time
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, cast
from urllib.parse import quote

from transientcam.errors import ParameterError
from transientcam.transport import translated

if TYPE_CHECKING:
    from zeroconf import ServiceInfo, ServiceListener, Zeroconf
    from zeroconf.asyncio import AsyncServiceInfo

SERVICE_TYPE: Final = "_transientcam._tcp.local."
WEB_TYPE: Final = "_http._tcp.local."
STATES: Final = ("arming", "starting", "streaming", "stopped", "calibrating", "lost")
"""What a camera can be said to do; the states of ``GET /camera``."""
MAX_CAMERAS: Final = 256
"""Names that one search asks for: any host may announce as many as it likes."""
_TEXT_CHARACTERS: Final = 64
_HOST_NAME: Final = re.compile(r"[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)*", re.ASCII)
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
    serial, firmware, model
        Of the camera; empty where they are not announced.
    api
        Versions of the interface, such as ``v1``.
    tls
        Whether it is https.
    state
        What it does, one of `STATES`; empty where that is not announced. A camera in another state
        is the same camera.
    """

    name: str
    url: str
    serial: str
    firmware: str
    api: str
    tls: bool
    model: str = ""
    state: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True)
class Search:
    """What a search has found.

    ``cameras``: those that answered, by name; at most `MAX_CAMERAS`.
    ``left_out``: how many more names were announced, which were not asked.
    """

    cameras: tuple[FoundCamera, ...]
    left_out: int


def discover(
    *, timeout_s: float = 2.0, interfaces: Sequence[str] | None = None
) -> tuple[FoundCamera, ...]:
    """Return the cameras that answer within ``timeout_s``, by name; at most `MAX_CAMERAS`.

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
    return search(timeout_s=timeout_s, interfaces=interfaces).cameras


def search(*, timeout_s: float, interfaces: Sequence[str] | None = None) -> Search:
    """Return the cameras that answer within ``timeout_s``, and how many names were not asked.

    Parameters and errors are those of `discover`.
    """
    from zeroconf import DNSQuestionType, InterfaceChoice, ServiceBrowser, Zeroconf

    if not timeout_s > 0.0:
        raise ParameterError("timeout_s", timeout_s, "above 0")
    for each in interfaces or ():
        _require_address(each)
    ends_s = time.monotonic() + timeout_s
    with translated(_PLACE):
        searched = list(interfaces) if interfaces else InterfaceChoice.All
        network = Zeroconf(interfaces=searched)
        names = _Names(network, ends_s)
        try:
            browser = ServiceBrowser(
                network,
                SERVICE_TYPE,
                # its base class is empty, and only there where zeroconf is installed
                listener=cast("ServiceListener", names),
                # answers to all: one to this port may reach another program that has it open
                question_type=DNSQuestionType.QM,
            )
            time.sleep(timeout_s)
            browser.cancel()
            found = names.answered()
        finally:
            network.close()
    return Search(tuple(found[name] for name in sorted(found)), names.left_out)


def _require_address(text: str) -> None:
    try:
        ipaddress.ip_address(text)
    except ValueError as error:
        limit = "the address of a network interface, such as 192.168.1.5"
        raise ParameterError("interfaces", text, limit) from error


class _Names:
    """Listens for names, and asks all of them at once where they are: many may never answer."""

    def __init__(self, network: "Zeroconf", ends_s: float) -> None:
        self._network = network
        self._ends_s = ends_s
        self._asked: dict[str, tuple[AsyncServiceInfo, Future[bool]]] = {}
        self.left_out = 0

    def add_service(self, zc: "Zeroconf", type_: str, name: str) -> None:
        if len(self._asked) < MAX_CAMERAS:
            self._ask(type_, name)
        else:
            self.left_out += 1

    def update_service(self, zc: "Zeroconf", type_: str, name: str) -> None:
        if name in self._asked:
            self._asked[name][1].cancel()
            self._ask(type_, name)

    def remove_service(self, zc: "Zeroconf", type_: str, name: str) -> None:
        if name in self._asked:
            self._asked.pop(name)[1].cancel()

    def answered(self) -> dict[str, FoundCamera]:
        """Return the cameras that have answered, by name, and wait for no other."""
        found = {}
        for name, (info, answer) in self._asked.items():
            complete = answer.done() and answer.exception() is None and answer.result()
            answer.cancel()
            camera = read_announcement(info) if complete else None
            if camera is not None:
                found[name] = camera
        return found

    def _ask(self, type_: str, name: str) -> None:
        from zeroconf import DNSQuestionType
        from zeroconf.asyncio import AsyncServiceInfo

        loop = self._network.loop
        assert loop is not None  # noqa: S101 - a network that is open has one
        left_ms = max(1, round((self._ends_s - time.monotonic()) * 1e3))
        info = AsyncServiceInfo(type_, name)
        request = info.async_request(self._network, left_ms, DNSQuestionType.QM)
        self._asked[name] = info, asyncio.run_coroutine_threadsafe(request, loop)


def read_announcement(info: "ServiceInfo") -> FoundCamera | None:
    """Return the camera that an announcement names; None where it names no address.

    Any host on the network may have sent it, so none of it is trusted.
    """
    host = _host_of(info)
    if host is None or not info.port:
        return None
    text = {key: _printable(value) for key, value in info.decoded_properties.items()}
    tls = text.get("tls") == "1"
    server = (info.server or "").rstrip(".")
    if tls and _HOST_NAME.fullmatch(server):
        host = server  # what its certificate names
    path = text.get("path", "/")
    scheme = "https" if tls else "http"
    place = quote(path, safe="/%-._~") if path.startswith("/") else ""
    state = text.get("state", "")
    return FoundCamera(
        name=_printable(info.get_name()),
        url=f"{scheme}://{host}:{info.port}{place}".rstrip("/"),
        serial=text.get("sn", ""),
        firmware=text.get("fw", ""),
        api=text.get("api", ""),
        tls=tls,
        model=text.get("model", ""),
        state=state if state in STATES else "",
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
    return "".join(each for each in text or "" if each.isprintable())[:_TEXT_CHARACTERS]
