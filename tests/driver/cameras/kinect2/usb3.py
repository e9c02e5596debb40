"""An emulated Kinect v2 on an emulated SuperSpeed bus, below the libusb of another process.

Bulk, control and isochronous transfers arrive as calls of usbfs, and go to the camera by the
link that the emulation has anyway.
"""

import errno
import socket
import struct
import threading
from collections import deque
from pathlib import Path

from tests.driver.cameras.open_usb.usbfs.usbfs import Client, Ioctl, Model, Refused, Urb, UsbfsMount
from transientcam_driver.errors import CameraError, CameraLost
from transientcam_simulation.emulated._kinect2.device import EmulatedKinect2, EmulatedLink
from transientcam_simulation.emulated._open_usb.descriptors import string_descriptors

SUPER_SPEED_MBIT, SUPER_SPEED = 5000, 5
PACKET_BYTES = 33_792
_ISO_URB, _CONTROL_URB = 0, 2
_URB_BYTES, _PACKET = 56, struct.Struct("<III")
_COUNT_AT = 36
_GET_DESCRIPTOR, _STRING, _GET_INTERFACE = 6, 3, 10
_SET_FEATURE, _FUNCTION_SUSPEND = 3, 0
_MOST_WAITING = 400
_CONTROL, _STREAM = 0, 1  # interfaces
_TO_INTERFACE = 0x01


def _endpoint(address: int, attributes: int, per_interval: int) -> bytes:
    endpoint = struct.pack("<BBBBHB", 7, 5, address, attributes, 1024, 1)
    return endpoint + struct.pack("<BBBBH", 6, 0x30, 15, 0, per_interval)


def _interface(number: int, alternate: int, *endpoints: bytes) -> bytes:
    head = struct.pack("<9B", 9, 4, number, alternate, len(endpoints), 255, 255, 255, 0)
    return head + b"".join(endpoints)


def chain(per_interval: int = PACKET_BYTES) -> bytes:
    """Descriptors of the device and its configuration (notes of libfreenect2's usb_control.cpp)."""
    device = struct.pack(
        "<BBHBBBBHHHBBBB", 18, 1, 0x0300, 0, 0, 0, 9, 0x045E, 0x02D8, 0x0100, 1, 2, 3, 1
    )
    below = _interface(0, 0, *(_endpoint(each, 2, 0) for each in (0x02, 0x81, 0x83)))
    below += _interface(1, 0) + _interface(1, 1, _endpoint(0x84, 1, per_interval))
    return device + struct.pack("<BBHBBBBB", 9, 2, 9 + len(below), 2, 1, 0, 0xC0, 0) + below


class OnBus:
    """The camera as a mount has it: with an address, which changes with each plug."""

    def __init__(self, camera: EmulatedKinect2, serial: str) -> None:
        self.camera = camera
        self.changed = camera.changed
        self.bus, self.address = 2, 1
        self.strings = string_descriptors(product="Xbox NUI Sensor", serial=serial)

    @property
    def plugged(self) -> bool:
        return self.camera.plugged

    def unplug(self) -> None:
        self.camera.unplug()

    def replug(self) -> None:
        self.camera.replug()
        self.address += 1

    def reset(self) -> None:
        """Nothing that a program would see."""

    def clear_halt(self) -> None:
        """Nothing that a program would see."""


class Usb3Mount(UsbfsMount):
    """The camera's node, and the packets that wait for isochronous transfers."""

    model = Model(0x045E, 0x02D8, SUPER_SPEED_MBIT, SUPER_SPEED, chain())

    def __init__(self, camera: EmulatedKinect2, serial: str, root: Path) -> None:
        self.packets: deque[bytes] = deque()
        self.streaming = False
        self.link: EmulatedLink | None = None
        self.requests_to_stall = 0
        self._switching = threading.Lock()
        super().__init__(OnBus(camera, serial), root)

    def client_of(self, connection: socket.socket) -> Client:
        return Usb3Client(self, connection)

    def linked(self) -> EmulatedLink:
        """Return the cable to the camera, which all open files share."""
        with self.device.changed:
            if self.link is None or not self.device.camera.is_at(self.link):
                self.link = self.device.camera.connect()
            return self.link

    def set_streaming(self, streaming: bool) -> None:
        """Let packets come, or none; the light is another matter."""
        with self._switching:
            self._take(False)  # else what waits in `push` would go on to do so
            link = self.linked()
            link.set_stream_enabled(streaming)
            link.stop_images()
            if streaming:
                self._take(True)
                link.start_images(self.push, lambda error: None)

    def _take(self, packets: bool) -> None:
        with self.device.changed:
            self.streaming = packets
            self.packets.clear()
            self.device.changed.notify_all()

    def close(self) -> None:
        if self.link is not None and self.device.plugged:
            self.set_streaming(False)
        super().close()

    def push(self, packet: bytes) -> None:
        """Keep a packet; the camera waits where the other side does not read."""
        with self.device.changed:
            self.device.changed.wait_for(
                lambda: len(self.packets) < _MOST_WAITING or not self.streaming
            )
            if self.streaming:
                self.packets.append(packet)
                self.device.changed.notify_all()

    def _move_images(self) -> None:
        with self.device.changed:
            while not self._closing:
                if not any(client.fill() for client in self.clients):
                    self.device.changed.wait()


class Usb3Client(Client):
    """One open file descriptor of the camera's node."""

    def __init__(self, mount: Usb3Mount, connection: socket.socket) -> None:
        super().__init__(mount, connection)
        self._usb = mount

    def serve(self) -> None:
        try:
            super().serve()
        finally:
            with self._device.changed:
                left = _STREAM not in self._usb.owners and self._usb.streaming
            if left and self._device.plugged:  # usb_unbind_interface: alternate setting 0
                self._usb.set_streaming(False)

    def fill(self) -> bool:
        """Complete the oldest isochronous transfer if there are packets for all of it."""
        urb = next((each for each in self.in_flight.values() if each.kind == _ISO_URB), None)
        if urb is None or len(self._usb.packets) < _packets(urb):
            return False
        urb.iso = [self._usb.packets.popleft() for _ in range(_packets(urb))]
        self.complete(urb, status=0)
        self._device.changed.notify_all()
        return True

    def submit(self, address: int) -> None:
        raw = self.read_memory(address, _URB_BYTES)
        kind, endpoint = raw[0], raw[1]
        (buffer,), (length,) = struct.unpack_from("<Q", raw, 16), struct.unpack_from("<i", raw, 24)
        if kind == _ISO_URB:
            self.claim(_STREAM)
            (count,) = struct.unpack_from("<i", raw, _COUNT_AT)
            raw += self.read_memory(address + _URB_BYTES, count * _PACKET.size)
            self.send_out(Urb(address, raw, kind, buffer, length))
            return
        if kind == _CONTROL_URB:
            super().submit(address)
            return
        urb = Urb(address, raw, kind, buffer, length)
        sent = self.read_memory(buffer, length) if not endpoint & 0x80 else b""
        status = 0
        try:
            urb.data = self.bulk(endpoint, length, sent)
            urb.actual = len(urb.data) if endpoint & 0x80 else length
        except Refused as refused:
            if refused.number == errno.EBUSY:
                raise
            status = -refused.number
        with self._device.changed:
            self.in_flight[address] = urb
            self.complete(urb, status=status)

    def bulk(self, endpoint: int, length: int, data: bytes) -> bytes:
        self.claim(_CONTROL)
        try:
            if endpoint & 0x80:
                return self._usb.linked().read(length)
            if self._usb.requests_to_stall:
                self._usb.requests_to_stall -= 1
                raise Refused(errno.EPIPE)
            self._usb.linked().write(data)
        except CameraLost:
            raise Refused(errno.ESHUTDOWN) from None
        except CameraError:
            raise Refused(errno.EPIPE) from None
        return b""

    def deliver(self, urb: Urb) -> None:
        if urb.kind != _ISO_URB:
            super().deliver(urb)
            return
        done, at, place = bytearray(urb.raw), urb.buffer, _URB_BYTES
        struct.pack_into("<i", done, 4, urb.status)
        for packet in urb.iso:
            room, _, _ = _PACKET.unpack_from(done, place)
            _PACKET.pack_into(done, place, room, len(packet), 0)
            self.write_memory(at, packet)
            at, place = at + room, place + _PACKET.size
        self.write_memory(urb.address, bytes(done))

    def _ioctl(self, request: int, argument: int) -> int:
        if request == Ioctl.SETINTERFACE and not self.gone:
            interface, alternate = struct.unpack("<II", self.read_memory(argument, 8))
            assert interface == _STREAM
            self.claim(_STREAM)
            self._usb.set_streaming(bool(alternate))
            return 0
        return super()._ioctl(request, argument)

    def control(
        self, request_type: int, request: int, value: int, index: int, length: int, data: bytes
    ) -> bytes:
        if request == _GET_DESCRIPTOR and value >> 8 == _STRING:
            string: bytes = self._device.strings[value & 0xFF]
            return string
        if request == _GET_INTERFACE:
            return bytes([self._usb.streaming])
        if (request_type, request, value) == (_TO_INTERFACE, _SET_FEATURE, _FUNCTION_SUSPEND):
            self.claim(_CONTROL)
            self._usb.linked().set_suspended(bool(index))
        return b""


def _packets(urb: Urb) -> int:
    return (len(urb.raw) - _URB_BYTES) // _PACKET.size
