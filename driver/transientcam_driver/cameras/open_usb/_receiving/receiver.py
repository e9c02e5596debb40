"""From transfers to frames: bytes to packets to frames."""

import threading
from collections import deque

from transientcam_driver.camera import AppliedSequence, Capabilities, Counters, RawFrame
from transientcam_driver.cameras.open_usb._receiving.assembler import FrameAssembler
from transientcam_driver.cameras.open_usb._receiving.decoder import PacketDecoder
from transientcam_driver.errors import ProtocolError


class Receiver:
    """Decoder and assembler of one connection, and the frames that are complete.

    The reading thread feeds it. A thread that changes the sequence or starts a run holds ``lock``
    from before its request until ``switch`` or ``restart`` has returned, so that no image is
    assembled before its labels are set. The lock is never held while waiting for an image.
    """

    def __init__(self, capabilities: Capabilities, counters: Counters) -> None:
        self.lock = threading.RLock()
        self._capabilities = capabilities
        self._counters = counters
        self._decoder = PacketDecoder(payload_bytes=capabilities.image_bytes)
        self._assembler: FrameAssembler | None = None
        self._frames: deque[RawFrame] = deque()

    def switch(self, applied: AppliedSequence, *, first_image: int) -> None:
        """Go on with a new sequence; frames of the one before are not delivered after this."""
        with self.lock:
            self._assembler = FrameAssembler(applied, self._capabilities, self._counters)
            self.restart(first_image=first_image)

    def restart(self, *, first_image: int) -> None:
        """Begin a new run of the same sequence."""
        with self.lock:
            self._decoder.reset()
            self._frames.clear()
            if self._assembler is not None:
                self._assembler.restart(first_image)

    def resynchronise(self) -> None:
        """Drop what was received of a failed transfer (usb-protocol 10.3)."""
        with self.lock:
            self._decoder.reset()
            self._counters.resyncs += 1

    def feed(self, data: memoryview, *, host_time_s: float) -> None:
        """Take the bytes of a transfer."""
        with self.lock:
            resyncs = self._decoder.resyncs
            for packet in self._decoder.feed(data):
                if self._assembler is None:
                    continue
                frame = self._assembler.push(packet, host_time_s=host_time_s)
                if frame is not None:
                    self._frames.append(frame)
            self._counters.resyncs += self._decoder.resyncs - resyncs

    def require_images_of_the_size_announced(self) -> None:
        """Compare the length in intact headers with the capabilities (usb-protocol 10.11).

        Raises ProtocolError: images of another length came in this run; one by one they are taken
        for noise.
        """
        odd_bytes = self._decoder.odd_payload_bytes
        if odd_bytes is not None:
            announced = self._capabilities.image_bytes
            raise ProtocolError(f"images of {odd_bytes} bytes, its capabilities say {announced}")

    def take(self) -> RawFrame | None:
        """Return the oldest complete frame, if there is one."""
        with self.lock:
            return self._frames.popleft() if self._frames else None
