"""From the bytes of the image endpoint to frames: receiver over decoder and assembler.

Nothing here reads from a device or waits; the camera feeds it with what it has read.
"""

from transientcam_driver.receiving.assembler import Counters, FrameAssembler, RawFrame
from transientcam_driver.receiving.decoder import ImagePacket, PacketDecoder
from transientcam_driver.receiving.hop import Hop
from transientcam_driver.receiving.receiver import Receiver

__all__ = [
    "Counters",
    "FrameAssembler",
    "Hop",
    "ImagePacket",
    "PacketDecoder",
    "RawFrame",
    "Receiver",
]
