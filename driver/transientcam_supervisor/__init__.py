"""A process of its own that switches a camera's light off where the one that owns it cannot.

A driver states an `OffSwitch`: plain steps, by which any process switches that light off. A
`Supervisor` starts the process and tells it again and again that the light is under control; at a
second of silence, and at the end of either process, it takes those steps. It has no threads and
imports nothing but the standard library: neither NumPy nor HDF5, nor anything of a camera.
"""

from transientcam_supervisor._supervisor import Supervisor, SupervisorEnded
from transientcam_supervisor._switch import (
    OffSwitch,
    Step,
    TcpMessage,
    UsbClaim,
    UsbControl,
    UsbRead,
    UsbReset,
    UsbSetting,
    UsbWrite,
)
