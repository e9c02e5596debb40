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
    http_client,
    require_direct,
    set_lease,
    stream_options,
)
