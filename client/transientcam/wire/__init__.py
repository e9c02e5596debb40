"""The wire contract of docs/stream.md, for both ends: constants, products, messages, parsing."""

from transientcam.documents import (
    FrameMeta,
    PixelCountsDocument as PixelCounts,
    PredictedStdDocument as PredictedStd,
    TrustCountsDocument as TrustCounts,
)
from transientcam.frame import Frame
from transientcam.wire import _fields as fields
from transientcam.wire._arrays import DTYPES, array_document, parse_array
from transientcam.wire._codec import ALIGNMENT, array_head, pack, unpack
from transientcam.wire._contract import (
    F32,
    FIRST_MESSAGE_WITHIN_S,
    LEASE_HEADER,
    MAX_CLIENT_MESSAGE_BYTES,
    MAX_CREDITS,
    MAX_DECIMATION,
    MAX_SERVER_MESSAGE_BYTES,
    MAX_SUBSCRIPTIONS,
    MEDIA_TYPE,
    MEDIA_TYPE_ALIASES,
    PROBLEM_MEDIA_TYPE,
    REFLECTION16,
    SUBPROTOCOL,
    U16,
    VERSION,
    CloseCode,
)
from transientcam.wire._encodings import (
    ENCODINGS,
    Coded,
    Encoding,
    decode_reflection16,
    decode_u16,
    encode_reflection16,
    encode_u16,
    encoding_names,
)
from transientcam.wire._messages import (
    Ack,
    Channel,
    ClientMessage,
    ErrorMessage,
    Hello,
    Notice,
    ServerMessage,
    Subscribe,
    Subscription,
    encode,
    encode_frame,
    frame_document,
)
from transientcam.wire._notices import NOTICES, NoticeKind
from transientcam.wire._parsing import (
    parse_channels,
    parse_client_message,
    parse_frame,
    parse_server_message,
)
from transientcam.wire._products import PRODUCTS, Product, Trust
