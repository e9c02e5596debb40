"""Files in, files out, with the daemon's arithmetic but without a daemon.

A `Measurement` becomes a `TransientCube`; a recording becomes products of every frame, or a file
of another format. `offline.opening` has it as a sequence of frames, for `transientcam.open`;
`offline.plot` draws, where matplotlib is installed.
"""

from transientcam_server.offline.convert import convert_recording
from transientcam_server.offline.measurement import (
    Measurement,
    TransientCube,
    load_measurement,
    reconstruct_measurement,
    save_cube,
)
from transientcam_server.offline.recording import BatchOptions, reconstruct_recording

__all__ = [
    "BatchOptions",
    "Measurement",
    "TransientCube",
    "convert_recording",
    "load_measurement",
    "reconstruct_measurement",
    "reconstruct_recording",
    "save_cube",
]
