"""The simulated device: firmware, USB device, and the pyusb backend it is mounted on.

Requests and transfers come in at the bus, the device keeps its endpoints and faults, and the
firmware speaks the protocol. What the sensor sees comes from a renderer, the simulated world.
"""

from transientcam_driver.simulation.device.bus import SimulatedBus
from transientcam_driver.simulation.device.faults import Fault, PendingFaults
from transientcam_driver.simulation.device.firmware import Firmware, Renderer
from transientcam_driver.simulation.device.prototype import prototype
from transientcam_driver.simulation.device.usb_device import EmulatedDevice

__all__ = [
    "EmulatedDevice",
    "Fault",
    "Firmware",
    "PendingFaults",
    "Renderer",
    "SimulatedBus",
    "prototype",
]
