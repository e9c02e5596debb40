"""Recordings: raw images and all that is needed to evaluate them again, in one HDF5 file.

`RecordingWriter` and `Recording` write and read one file, `recover` repairs one whose writer
died, `ReplayCamera` plays one as a camera. `Library` is the directory of a running service.
"""

from transientcam_server.recording import _recovery as recovery, _swmr as swmr
from transientcam_server.recording._columns import AXES, as_json, attributes_of, columns_of
from transientcam_server.recording._disk import DiskFile, open_to_write
from transientcam_server.recording._disk_threads import DISK_THREADS, DiskThreads
from transientcam_server.recording._frames import (
    Find,
    RecordedFramesCache,
    SettingsChoice,
    open_found,
    recorded_recipe,
    timeline,
)
from transientcam_server.recording._heaps import require_sound_heaps
from transientcam_server.recording._layout import Header
from transientcam_server.recording._library import Library, RecordingOptions
from transientcam_server.recording._listing import Order, select, tags_of
from transientcam_server.recording._product_stores import (
    EVERY_CHUNK,
    FORMAT,
    METADATA,
    ProductStore,
    ProductStores,
)
from transientcam_server.recording._reader import Recording
from transientcam_server.recording._recorder import Limits
from transientcam_server.recording._recovery import recover
from transientcam_server.recording._replay import ReplayCamera
from transientcam_server.recording._salvage import salvage
from transientcam_server.recording._storage import Storage, open_unknown
from transientcam_server.recording._uploads import Upload
from transientcam_server.recording._writer import RecordingWriter
from transientcam_server.recording._zarr_keys import ZarrKeys, is_of_chunk
