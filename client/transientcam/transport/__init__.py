"""How requests and streams travel: addresses, options of httpx and websockets, their errors.

It translates between the network libraries and the values of `transientcam.requests`; what is sent,
and when, is up to the caller.
"""

from transientcam.transport.address import parse_address
from transientcam.transport.errors import translated
from transientcam.transport.options import (
    DownloadProgress,
    Progress,
    answer_of,
    http_options,
    request_options,
    stream_options,
)

__all__ = [
    "DownloadProgress",
    "Progress",
    "answer_of",
    "http_options",
    "parse_address",
    "request_options",
    "stream_options",
    "translated",
]
