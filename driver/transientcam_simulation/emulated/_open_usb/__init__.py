"""The simulated device: firmware, USB device, and the pyusb backend it is mounted on.

Requests and transfers come in at the bus, the device keeps its endpoints and faults, and the
firmware speaks the protocol. What the sensor sees comes from a renderer, the simulated world.
"""

from transientcam_simulation.emulated._open_usb.bus import SimulatedBus
from transientcam_simulation.emulated._open_usb.faults import Fault, PendingFaults
from transientcam_simulation.emulated._open_usb.firmware import Firmware, Renderer
from transientcam_simulation.emulated._open_usb.prototype import prototype
from transientcam_simulation.emulated._open_usb.usb_device import EmulatedDevice
