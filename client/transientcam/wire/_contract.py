"""Names and limits common to both ends."""

from enum import IntEnum
from typing import Final

VERSION: Final = 1
SUBPROTOCOL: Final = "transientcam.v1.msgpack"
MEDIA_TYPE: Final = "application/vnd.msgpack"
MEDIA_TYPE_ALIASES: Final = ("application/msgpack", "application/x-msgpack")
PROBLEM_MEDIA_TYPE: Final = "application/problem+json"

LEASE_HEADER: Final = "Transientcam-Lease"
"""Names the lease that a request is made under."""

MAX_CLIENT_MESSAGE_BYTES: Final = 64 * 1024
"""The server reads no message longer than this."""
MAX_SERVER_MESSAGE_BYTES: Final = 512 * 1024 * 1024
"""The client reads no message longer than this: 640 x 480 at 32 harmonics is 80 MB."""
MAX_SUBSCRIPTIONS: Final = 16
F32: Final = "f32"
"""Unchanged values, whatever their dtype."""
U16: Final = "u16"
"""Images of float in steps: ``offset + scale * code``."""
REFLECTION16: Final = "reflection16"
"""Coefficients as reflection coefficients of 16 bits a part; approximate."""
MAX_CREDITS: Final = 64
MAX_DECIMATION: Final = 64
"""At most every 64th pixel is sent, both ways."""
FIRST_MESSAGE_WITHIN_S: Final = 10.0


class CloseCode(IntEnum):
    """Why a stream ended; below 4000 as in RFC 6455."""

    NORMAL = 1000
    GOING_AWAY = 1001
    """The server shuts down."""
    ABNORMAL = 1006
    """The connection broke; never sent."""
    POLICY = 1008
    """The origin of the page is not allowed."""
    TOO_BIG = 1009
    INTERNAL_ERROR = 1011
    TRY_AGAIN_LATER = 1013
    """Too many clients, or too many messages wait for this one."""
    BAD_FIRST_MESSAGE = 4001
    """The first message was missing, late, or no valid ``subscribe``."""
    AUTHENTICATION_FAILED = 4003
    TOO_MANY_MESSAGES = 4008
    """The client sent more messages a second than the server reads."""
