"""The address of a camera's daemon, for requests and for streams."""

import re
from dataclasses import dataclass
from urllib.parse import urlsplit, urlunsplit

from transientcam.errors import ParameterError

_STREAM_SCHEMES = {"http": "ws", "https": "wss"}


@dataclass(frozen=True, slots=True)
class Address:
    """The daemon's address, without a slash at its end.

    A path is kept, so that a camera may live below one behind a proxy.
    """

    url: str

    @property
    def shown(self) -> str:
        """What may stand in a sentence: without a user's name and password."""
        return without_secrets(self.url)

    @property
    def api(self) -> str:
        """Start of the address of every resource."""
        return f"{self.url}/api/v1"

    @property
    def stream(self) -> str:
        """Address of the stream."""
        parts = urlsplit(self.api)
        return urlunsplit(parts._replace(scheme=_STREAM_SCHEMES[parts.scheme])) + "/stream"


def without_secrets(url: str) -> str:
    """Return an address without what may be secret in it: user, password, query and fragment."""
    head, mark, rest = url.partition("://")
    host = re.split(r"[/?#]", rest if mark else head, maxsplit=1)[0]
    path = (rest if mark else head)[len(host) :]
    plain = re.split(r"[?#]", path, maxsplit=1)[0]
    return f"{head if mark else ''}{mark}{host.rpartition('@')[2]}{plain}"


def parse_address(url: str) -> Address:
    """Return the address that ``url`` means; without a scheme it is taken for ``http``.

    Raises ParameterError if it has another scheme than http or https, no host, a bad port, a query
    or a fragment.
    """
    limit = "an address like http://127.0.0.1:8000"
    try:
        parts = urlsplit(url if "://" in url else f"http://{url}")
        _ = parts.port  # checked only when it is read
    except ValueError as error:
        raise ParameterError("url", without_secrets(url), limit) from error
    if parts.scheme not in _STREAM_SCHEMES or not parts.hostname or parts.query or parts.fragment:
        raise ParameterError("url", without_secrets(url), limit)
    return Address(urlunsplit(parts).rstrip("/"))
