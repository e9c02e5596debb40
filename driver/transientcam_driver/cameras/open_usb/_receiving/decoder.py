"""Find image packets in a stream of bytes, whatever the read boundaries."""

from dataclasses import dataclass

from transientcam_driver.camera import IMAGE_HEADER_BYTES
from transientcam_driver.cameras.open_usb.protocol import IMAGE_MAGIC, ImageHeader, payload_checksum


@dataclass(frozen=True, slots=True)
class ImagePacket:
    """One image as it arrived; ``intact`` is false when its pixels fail their checksum.

    ``payload`` is read-only, and stays as it is while later bytes come.
    """

    header: ImageHeader
    payload: bytes | memoryview
    intact: bool = True


class PacketDecoder:
    """Turn bytes into image packets; never raises, whatever the bytes.

    A packet is found by its magic and its header's checksum (usb-protocol 8.2). A header that
    announces another payload than ``payload_bytes`` is taken for noise, so that a damaged length
    neither swallows nor delays the packets behind it. After pixels with a wrong checksum the
    search goes on right behind the header, because a shortened image has its successor inside.

    ``resyncs``: how often bytes had to be passed over.
    ``odd_payload_bytes``: length in the last intact header that announced another one (usb-protocol
    10.11), or None.
    """

    def __init__(self, *, payload_bytes: int) -> None:
        self._payload_bytes = payload_bytes
        self._buffer = bytearray()
        self._lost_track = False
        self.resyncs = 0
        self.odd_payload_bytes: int | None = None

    def reset(self) -> None:
        """Drop the bytes of a stream that was interrupted."""
        self._buffer.clear()
        self.odd_payload_bytes = None
        self._lost_track = False

    def feed(self, data: bytes | bytearray | memoryview) -> list[ImagePacket]:
        """Take the next bytes, which are copied, and return the packets they complete."""
        self._buffer += data
        packets: list[ImagePacket] = []
        start = 0
        while True:
            start, found = self._header_at(start)
            if found is None:
                break
            end = start + IMAGE_HEADER_BYTES + self._payload_bytes
            if end > len(self._buffer):
                break
            payload = memoryview(self._buffer)[start + IMAGE_HEADER_BYTES : end].toreadonly()
            intact = payload_checksum(payload) == found.payload_crc
            packets.append(ImagePacket(found, payload, intact))
            # usb-protocol 8.2: with a wrong CRC the image may have been cut short
            start = end if intact else start + IMAGE_HEADER_BYTES
            self._lost_track = not intact
        if start:  # payloads are views of this buffer: the rest goes on in another
            self._buffer = self._buffer[start:]
        return packets

    def _header_at(self, start: int) -> tuple[int, ImageHeader | None]:
        """Find the next header at or after ``start``; without one, where to go on searching.

        Read boundaries mean nothing here (usb-protocol 8.2).
        """
        while True:
            found = self._buffer.find(IMAGE_MAGIC, start)
            if found < 0:
                # the last bytes received may be the first of the magic
                found = max(start, len(self._buffer) - len(IMAGE_MAGIC) + 1)
                self._skip(start, found)
                return found, None
            self._skip(start, found)
            if found + IMAGE_HEADER_BYTES > len(self._buffer):
                return found, None
            header = ImageHeader.unpack(bytes(self._buffer[found : found + IMAGE_HEADER_BYTES]))
            if header is not None:
                if header.payload_bytes == self._payload_bytes:
                    return found, header
                # usb-protocol 8.2: noise, unless all images are like that (10.11)
                self.odd_payload_bytes = header.payload_bytes
            start = found + 1

    def _skip(self, start: int, end: int) -> None:
        if end > start and not self._lost_track:
            self._lost_track = True
            self.resyncs += 1
