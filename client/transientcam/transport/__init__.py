"""How requests and streams travel: addresses, options of httpx and websockets, their errors.

Nothing here sends or receives: it converts between the network libraries and the values of
`transientcam.requests`.
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
