"""The sockets of an emulated TOFcam660: one thread that waits for all of them."""

import selectors
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from transientcam_driver.cameras.tofcam660 import (
    DATA_PORT,
    HEAD_BYTES,
    TAIL_BYTES,
    PacketHeader,
    payload_bytes,
    require_end,
)
from transientcam_driver.errors import CameraError, ProtocolError
from transientcam_simulation.emulated._open_usb import Fault, PendingFaults
from transientcam_simulation.emulated._tofcam660.firmware import EmulatedFirmware

_PACKET_BYTES: Final = 1400
_BURST: Final = 16
_BURST_S: Final = 2e-3
"""16 packets in 2 ms are 90 Mbit/s: what arrives faster than it is read would be lost."""
_SEND_S: Final = 5.0
_CORRUPT_TYPE: Final = 9
_LOST_PACKET: Final = 3
_READ_BYTES: Final = 4096


class EmulatedTofcam660:
    """An emulated camera on the network, from its construction until `close`.

    ``power_on``: makes the firmware, at the start and when the cable is plugged in again.
    ``host``: address to listen on.
    ``control_port``, ``data_port``: for commands and for images over TCP; 0 takes any free one.
    ``udp_port``: of the host, where images over UDP go.
    Raises CameraError where a port cannot be had.
    """

    def __init__(
        self,
        power_on: Callable[[], EmulatedFirmware],
        *,
        host: str = "127.0.0.1",
        control_port: int = 0,
        data_port: int = 0,
        udp_port: int = DATA_PORT,
    ) -> None:
        self._power_on = power_on
        self._firmware = power_on()
        self._host = host
        self.udp_port = udp_port
        self._faults = PendingFaults("TOFcam660", Fault.DROP, Fault.CORRUPT_PIXELS)
        self._measurement = 0
        self._selector = selectors.DefaultSelector()
        self._lock = threading.Lock()  # held while a request is served, and while the cable moves
        self._buffers: dict[socket.socket, bytearray] = {}
        self._images: socket.socket | None = None
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._udp.bind((host, 0))  # hosts take packets from the camera's address alone
        self._awake, self._waker = socket.socketpair()
        self._selector.register(self._awake, selectors.EVENT_READ)
        self._closed = False
        self.plugged = False
        try:
            self.control_port, self.data_port = self._listen(control_port, data_port)
        except OSError as error:
            self._release()
            raise CameraError(f"{host}: a port cannot be had ({error.strerror})") from error
        self._thread = threading.Thread(target=self._run, name="tofcam660", daemon=True)
        self._thread.start()

    @property
    def host(self) -> str:
        """Address that it listens on."""
        return self._host

    # --- cable and faults --------------------------------------------------------------------

    def unplug(self) -> None:
        """Pull the cable, and with it the power."""
        with self._paused():
            if self.plugged:
                self.plugged = False
                for each in (*self._listeners, *self._buffers):
                    self._forget(each)

    def replug(self) -> None:
        """Plug the cable in again: power-up, at the same address. No effect on a plugged one."""
        with self._paused():
            if not self.plugged:
                self._firmware = self._power_on()
                self._listen(self.control_port, self.data_port)

    def inject(self, fault: Fault, images: int = 1) -> None:
        """Lose or spoil the next images.

        Raises CameraError where this camera knows no such fault.
        """
        self._faults.inject(fault, images)

    def close(self) -> None:
        """End it; may be called twice."""
        if not self._closed:
            self._closed = True
            self._waker.send(b"\0")
            self._thread.join()
            self._release()

    # --- the thread --------------------------------------------------------------------------

    def _run(self) -> None:
        while not self._closed:
            for key, _ in self._selector.select():
                if key.fileobj is self._awake:
                    self._awake.recv(_READ_BYTES)
                    continue
                with self._lock:
                    if self.plugged and isinstance(key.fileobj, socket.socket):
                        key.data(key.fileobj)

    def _listen(self, control_port: int, data_port: int) -> tuple[int, int]:
        listeners = []
        for port, accept in ((control_port, self._accept_control), (data_port, self._accept_data)):
            listener = socket.create_server((self._host, port))
            listener.setblocking(False)
            self._selector.register(listener, selectors.EVENT_READ, accept)
            listeners.append(listener)
        self._listeners = tuple(listeners)
        self.plugged = True
        control, data = (each.getsockname()[1] for each in listeners)
        return control, data

    def _accept_control(self, listener: socket.socket) -> None:
        self._accept(listener, self._read_request)

    def _accept_data(self, listener: socket.socket) -> None:
        self._images = self._accept(listener, self._read_nothing) or self._images

    def _accept(
        self, listener: socket.socket, read: Callable[[socket.socket], None]
    ) -> socket.socket | None:
        try:
            connection, _ = listener.accept()
        except OSError:  # it is gone already
            return None
        connection.settimeout(_SEND_S)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._buffers[connection] = bytearray()
        self._selector.register(connection, selectors.EVENT_READ, read)
        return connection

    def _read_nothing(self, connection: socket.socket) -> None:
        self._received(connection)

    def _received(self, connection: socket.socket) -> bytes:
        """Return what came; without any the connection is forgotten."""
        try:
            data = connection.recv(_READ_BYTES)
        except OSError:
            data = b""
        if not data:
            self._forget(connection)
        return data

    def _read_request(self, connection: socket.socket) -> None:
        buffer = self._buffers[connection]
        buffer += self._received(connection)
        try:
            while len(buffer) >= HEAD_BYTES:
                size = payload_bytes(bytes(buffer[:HEAD_BYTES]))
                end = HEAD_BYTES + size + TAIL_BYTES
                if len(buffer) < end:
                    return
                require_end(bytes(buffer[end - TAIL_BYTES : end]))
                payload = bytes(buffer[HEAD_BYTES : HEAD_BYTES + size])
                del buffer[:end]
                self._serve(connection, payload)
        except (ProtocolError, OSError):
            self._forget(connection)

    def _serve(self, connection: socket.socket, payload: bytes) -> None:
        answer, image = self._firmware.handle(payload)
        connection.sendall(answer)
        if image is None:
            return
        self._measurement = (self._measurement + 1) % (1 << 16)
        if self._faults.take(Fault.CORRUPT_PIXELS):
            image = image[:1] + _CORRUPT_TYPE.to_bytes(2, "big") + image[3:]
        lost = self._faults.take(Fault.DROP)
        if not self._firmware.over_tcp:
            peer = self._firmware.data_address or connection.getpeername()[0]
            self._send_packets(image, peer, lost=lost)
        elif self._images is not None and not lost:
            try:
                self._images.sendall(image)
            except OSError:
                self._forget(self._images)

    def _send_packets(self, image: bytes, peer: str, *, lost: bool) -> None:
        count = -(-len(image) // _PACKET_BYTES)
        pause = threading.Event()
        for number in range(count):
            offset = number * _PACKET_BYTES
            data = image[offset : offset + _PACKET_BYTES]
            header = PacketHeader(self._measurement, len(image), len(data), offset, count, number)
            if not (lost and number == min(_LOST_PACKET, count - 1)):
                with suppress(OSError):
                    self._udp.sendto(header.pack() + data, (peer, self.udp_port))
            if number % _BURST == _BURST - 1:
                pause.wait(_BURST_S)

    # --- what both sides do ------------------------------------------------------------------

    def _paused(self) -> threading.Lock:
        """Return the lock under which the thread serves nothing; it looks at sockets anew."""
        self._waker.send(b"\0")
        return self._lock

    def _forget(self, connection: socket.socket) -> None:
        with suppress(KeyError, ValueError):
            self._selector.unregister(connection)
        self._buffers.pop(connection, None)
        if connection is self._images:
            self._images = None
        connection.close()

    def _release(self) -> None:
        for each in (*getattr(self, "_listeners", ()), *list(self._buffers)):
            self._forget(each)
        for each in (self._udp, self._awake, self._waker):
            each.close()
        self._selector.close()
