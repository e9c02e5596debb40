from ._foxglove_bridge import SHOWN as SHOWN, FoxgloveBridge as FoxgloveBridge
from ._foxglove_messages import Encoded as Encoded
from ._messages import (
    CAMERA_FRAME as CAMERA_FRAME,
    OPTICAL_FRAME as OPTICAL_FRAME,
    Calibration as Calibration,
    Image as Image,
    Message as Message,
    Pinhole as Pinhole,
    Points as Points,
    Transform as Transform,
    messages_of as messages_of,
    viewable as viewable,
)
from ._reports import Report as Report
from ._rerun_bridge import (
    BINS as BINS,
    LOGGED as LOGGED,
    RerunBridge as RerunBridge,
    blueprint as blueprint,
)
from ._source import Source as Source, captured_s as captured_s
