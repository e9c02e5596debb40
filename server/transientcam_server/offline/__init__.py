"""Files in, files out, with the daemon's arithmetic but without a daemon.

A `Measurement` becomes a `TransientCube`; a recording becomes products of every frame, or a file
of another format. `offline.opening` has it as a sequence of frames, for `transientcam.open`;
`offline.plot` draws, where matplotlib is installed.
"""

from transientcam_server.offline import _plot as plot
from transientcam_server.offline._cluster import completed, reconstruct_on
from transientcam_server.offline._computing import known_products
from transientcam_server.offline._convert import convert_recording
from transientcam_server.offline._impulse_responses import is_tal
from transientcam_server.offline._job import installed, load_kernels, require_versions
from transientcam_server.offline._kinect2 import import_kinect2, read_lens
from transientcam_server.offline._mcap import lens_of, ros2_message
from transientcam_server.offline._measurement import (
    Measurement,
    TransientCube,
    load_measurement,
    reconstruct_measurement,
    save_cube,
)
from transientcam_server.offline._place import recording_at
from transientcam_server.offline._recording import (
    BatchOptions,
    BatchReconstructor,
    default_products,
    reconstruct_recording,
)
from transientcam_server.offline._stability import stability
