"""How requests and streams travel: addresses, options of httpx and websockets, their errors.

Nothing here sends or receives: it converts between the network libraries and the values of
`transientcam.requests`.
"""

from transientcam.transport._address import parse_address, without_secrets
from transientcam.transport._deadline import Deadline
from transientcam.transport._errors import media_type, translated
from transientcam.transport._exchange import (
    answer_of,
    bounded,
    exchange,
    exchange_async,
    read,
    read_async,
    require_plain,
    within,
)
from transientcam.transport._options import (
    QUIET,
    DownloadProgress,
    Progress,
    http_options,
    require_direct,
    set_lease,
    stream_options,
)

__all__ = [
    "QUIET",
    "Deadline",
    "DownloadProgress",
    "Progress",
    "answer_of",
    "bounded",
    "exchange",
    "exchange_async",
    "http_options",
    "media_type",
    "parse_address",
    "read",
    "read_async",
    "require_direct",
    "require_plain",
    "set_lease",
    "stream_options",
    "translated",
    "within",
    "without_secrets",
]
