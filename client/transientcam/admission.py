"""Who may enter a program that speaks for a daemon: what its ports ask of each connection.

A browser lets every page open a WebSocket to this machine, and every user of the machine reaches
its ports. What such a program shows, or lets others change, it does with a right of its own (its
token); so it asks for a secret, and for the page that a connection comes from.
"""

import secrets
import socket
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from ipaddress import ip_address
from typing import Final
from urllib.parse import urlsplit

from transientcam.errors import ParameterError

_SECRET_BYTES: Final = 16


def on_loopback(host: str) -> bool:
    """Return whether a host to serve at is reached from this machine only."""
    try:
        return ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host.lower() == "localhost"


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a connection may not enter: a status of HTTP, and a sentence."""

    status: int
    reason: str


class Admission:
    """What a connection has to show before anything is sent to it or read of it.

    ``host``: where it is served. Beside addresses of this machine a ``Host`` header may name it,
    and this machine if others reach it; else a page could rebind its own name to this address.
    ``secret``: path of the address, without its slash; None where everybody who reaches the port
    may enter.
    ``origins``: pages that may connect, such as https://app.foxglove.dev; programs have no origin.
    Raises ParameterError if an origin is none.
    """

    def __init__(self, host: str, *, secret: str | None, origins: Iterable[str] = ()) -> None:
        self._host = host
        self._expected = None if secret is None else f"/{secret}".encode()
        self._origins = {_origin(each) for each in origins}
        self._any_address = not on_loopback(host)
        name = socket.gethostname().lower()
        short = name.partition(".")[0]
        others = {name, short, f"{short}.local"} if self._any_address else set()
        self._names = {"localhost", host.lower().strip("[]"), *others}

    @classmethod
    def to(cls, host: str, *, lends_right: bool, origins: Iterable[str] = ()) -> "Admission":
        """Return the door of a program that serves at ``host``.

        There is a new secret where it uses a right of its own for who enters (a token, control),
        or where other machines reach it.
        """
        closed = lends_right or not on_loopback(host)
        secret = secrets.token_urlsafe(_SECRET_BYTES) if closed else None
        return cls(host, secret=secret, origins=origins)

    @property
    def host(self) -> str:
        """The host in its address; where it serves at all addresses, this machine's name."""
        try:
            address = ip_address(self._host.strip("[]"))
        except ValueError:
            return self._host
        if address.is_unspecified:
            return socket.gethostname()
        return f"[{address}]" if address.version == 6 else str(address)

    @property
    def path(self) -> str:
        """What stands behind the port in the address of who may enter."""
        return "" if self._expected is None else self._expected.decode()

    def refusal(self, path: str, *, hosts: Sequence[str], origins: Sequence[str]) -> Refusal | None:
        """Return why a request may not enter, None if it may.

        ``path``: as the request line has it.
        ``hosts``, ``origins``: values of all headers of these names.
        """
        if len(hosts) != 1 or not self._is_ours(hosts[0]):
            return Refusal(421, "the Host header names no host that is served here")
        if origins and (len(origins) > 1 or origins[0].lower() not in self._origins):
            return Refusal(403, "a page of another origin may not connect: see --origin")
        given = path.partition("?")[0].encode("utf-8", "surrogateescape")
        if self._expected is not None and not secrets.compare_digest(given, self._expected):
            return Refusal(401, "the address has no secret, or an old one")
        return None

    def _is_ours(self, host: str) -> bool:
        try:
            name = urlsplit(f"//{host}").hostname or ""
        except ValueError:
            return False
        if name in self._names:
            return True
        try:
            address = ip_address(name)
        except ValueError:
            return False
        return self._any_address or address.is_loopback


def _origin(text: str) -> str:
    limit = "the origin of a page, such as https://app.foxglove.dev"
    try:
        parts = urlsplit(text.lower())
        _ = parts.port
    except ValueError as error:
        raise ParameterError("origin", text, limit) from error
    if not parts.scheme or parts.path.strip("/") or parts.query or parts.fragment or parts.username:
        raise ParameterError("origin", text, limit)
    return f"{parts.scheme}://{parts.netloc}"
