"""From the bytes of the image endpoint to frames: receiver over decoder and assembler.

Nothing here reads from a device or waits; the camera feeds it with what it has read.
"""

from transientcam_driver.cameras.open_usb._receiving.assembler import FrameAssembler
from transientcam_driver.cameras.open_usb._receiving.decoder import ImagePacket, PacketDecoder
from transientcam_driver.cameras.open_usb._receiving.receiver import Receiver
