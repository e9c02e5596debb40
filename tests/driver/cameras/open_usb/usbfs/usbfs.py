"""Mount an emulated device as /dev/bus/usb/BBB/DDD under umockdev's preload library.

A process that runs with ``UMOCKDEV_DIR=<root>`` and the preload library sees the device tree
below ``<root>``; its ioctls on the device node arrive here over a socket, so that libusb in that
process is the real one, doing real usbfs calls. What usbfs does is in the kernel's
linux/usbdevice_fs.h and drivers/usb/core/devio.c; what travels on the sockets in umockdev's
src/umockdev-preload.c and src/uevent_sender.c.
"""

import errno
import fcntl
import os
import socket
import struct
import threading
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
from typing import Any

from transientcam_driver.cameras.open_usb.protocol import PRODUCT_ID, VENDOR_ID
from transientcam_simulation.emulated._open_usb import descriptors
from transientcam_simulation.emulated._open_usb.usb_device import Overflow, Stall, Unplugged

DEVICE_PATH = "/devices/pci0000:00/0000:00:14.0/usb1/1-1"
HIGH_SPEED_MBIT, HIGH_SPEED = 480, 3
CAPABILITIES = 0x01 | 0x04 | 0x10  # zero packets, no size limit, reap after disconnect

_MESSAGE = struct.Struct("<QQQ")
_IOCTL, _DONE, _READ_MEMORY, _WRITE_MEMORY = 1, 3, 5, 6
_URB = struct.Struct("<BBxxiI4xQiiiiIIQ")
_CONTROL_URB, _BULK_URB = 2, 3
_SETUP = struct.Struct("<BBHHH")
_SYNCHRONOUS_CONTROL, _SYNCHRONOUS_BULK = struct.Struct("<BBHHHI4xQ"), struct.Struct("<III4xQ")
_CLAIM = struct.Struct("<II256s")
_EXCEPT_DRIVER = 0x02


def _number(direction: int, number: int, size: int) -> int:
    """Build the number of an ioctl of usbfs (asm-generic/ioctl.h)."""
    return direction << 30 | size << 16 | ord("U") << 8 | number


class Ioctl(IntEnum):
    """The ioctls that libusb and a supervisor use."""

    CONTROL = _number(3, 0, 24)
    BULK = _number(3, 2, 24)
    RESETEP = _number(2, 3, 4)
    SETINTERFACE = _number(2, 4, 8)
    SETCONFIGURATION = _number(2, 5, 4)
    GETDRIVER = _number(1, 8, 260)
    SUBMITURB = _number(2, 10, 56)
    DISCARDURB = _number(0, 11, 0)
    REAPURB = _number(1, 12, 8)
    REAPURBNDELAY = _number(1, 13, 8)
    CLAIMINTERFACE = _number(2, 15, 4)
    RELEASEINTERFACE = _number(2, 16, 4)
    RESET = _number(0, 20, 0)
    CLEAR_HALT = _number(2, 21, 4)
    GET_CAPABILITIES = _number(2, 26, 4)
    DISCONNECT_CLAIM = _number(2, 27, 264)
    GET_SPEED = _number(0, 31, 0)


class Refused(Exception):  # noqa: N818 - what the kernel does
    """The ioctl fails with this errno."""

    def __init__(self, number: int) -> None:
        super().__init__(errno.errorcode[number])
        self.number = number


@dataclass
class Urb:
    """A transfer that libusb has submitted: where it lies in the client, and what came of it."""

    address: int
    raw: bytes
    kind: int
    buffer: int
    length: int
    data: bytes = b""
    actual: int = 0
    status: int = 0
    iso: list[bytes] = field(default_factory=list)
    """Packets of an isochronous one."""


@dataclass(frozen=True)
class Model:
    """What the kernel knows of a device without asking it; ``chain`` are its descriptors."""

    vendor_id: int = VENDOR_ID
    product_id: int = PRODUCT_ID
    speed_mbit: int = HIGH_SPEED_MBIT
    speed: int = HIGH_SPEED
    chain: bytes = descriptors.DEVICE_DESCRIPTOR + descriptors.CONFIGURATION_DESCRIPTOR


class UsbfsMount:
    """One emulated device in a tree of files below ``root``."""

    model = Model()

    def __init__(self, device: Any, root: Path) -> None:
        self.device = device
        self.clients: list[Client] = []
        self.owners: dict[int, Client] = {}
        self.memory_bytes: int | None = None  # what usbfs_memory_mb leaves for transfers
        self._root = root
        self._events = 0
        self._closing = False
        (root / "run" / "udev").mkdir(parents=True)
        (root / "run" / "udev" / "control").touch()
        (root / "sys" / "class").mkdir(parents=True)
        self._plug()
        self._pump = threading.Thread(target=self._move_images)
        self._pump.start()

    def unplug(self) -> None:
        """Pull the cable: what is in flight fails, and udev sends an event."""
        with self.device.changed:
            self.device.unplug()
            for client in self.clients:
                for urb in tuple(client.in_flight.values()):
                    client.complete(urb, status=-errno.ESHUTDOWN)
            self.owners.clear()
        self._announce("remove")

    def replug(self) -> None:
        """Plug in again, under a new address."""
        self._withdraw()
        self.device.replug()
        self._plug()
        self._announce("add")

    def close(self) -> None:
        """End the threads."""
        with self.device.changed:
            self._closing = True
            self.device.changed.notify_all()
        self._pump.join()
        self._withdraw()
        with self.device.changed:
            clients = tuple(self.clients)
        for client in clients:
            client.close()

    def client_of(self, connection: socket.socket) -> "Client":
        """Return what serves an open file descriptor."""
        return Client(self, connection)

    # --- the tree of files ----------------------------------------------------------------

    def _plug(self) -> None:
        node = f"/dev/bus/usb/{self.device.bus:03d}/{self.device.address:03d}"
        self._node = self._root / node[1:]
        self._properties = (
            f"DEVTYPE=usb_device\nDRIVER=usb\nBUSNUM={self.device.bus:03d}\n"
            f"DEVNUM={self.device.address:03d}\nDEVNAME={node}\nMAJOR=189\n"
            f"MINOR={self.device.address - 1}\n"
        )
        folder = self._root / "sys" / DEVICE_PATH[1:]
        folder.mkdir(parents=True, exist_ok=True)
        attributes = {
            "busnum": f"{self.device.bus}\n",
            "devnum": f"{self.device.address}\n",
            "speed": f"{self.model.speed_mbit}\n",
            "bConfigurationValue": "1\n",
            "idVendor": f"{self.model.vendor_id:04x}\n",
            "idProduct": f"{self.model.product_id:04x}\n",
            # the kernel has read these when the device was plugged in
            "manufacturer": self._string(1),
            "product": self._string(2),
            "serial": self._string(3),
            "uevent": self._properties.replace("/dev/", ""),
        }
        for name, text in attributes.items():
            (folder / name).write_text(text)
        (folder / "descriptors").write_bytes(self.model.chain)
        self._link(folder / "subsystem", "../../../../../bus/usb")
        self._link(self._root / "sys/bus/usb/devices/1-1", f"../../..{DEVICE_PATH}")
        self._node.parent.mkdir(parents=True, exist_ok=True)
        # A pipe stands for the node: it is writable when a transfer can be reaped, as usbfs is.
        os.mkfifo(self._node)
        self._pipe = os.open(self._node, os.O_RDWR | os.O_NONBLOCK)
        self._pipe_bytes = fcntl.fcntl(self._pipe, fcntl.F_SETPIPE_SZ, 4096)
        self._full = False
        self.show_reapable(False)
        address = self._root / "ioctl" / node[1:]
        address.parent.mkdir(parents=True, exist_ok=True)
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(str(address))
        self._listener.listen()
        threading.Thread(target=self._accept, args=(self._listener,)).start()

    def _string(self, index: int) -> str:
        descriptor: bytes = self.device.strings[index]
        return descriptor[2:].decode("utf-16-le") + "\n"

    def _withdraw(self) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        (self._root / "ioctl" / self._node.relative_to(self._root)).unlink()
        self._node.unlink()
        os.close(self._pipe)

    @staticmethod
    def _link(path: Path, target: str) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.is_symlink():
            path.symlink_to(target)

    def show_reapable(self, reapable: bool) -> None:
        """Make the node writable, or not, for programs that poll it."""
        if reapable and self._full:
            os.read(self._pipe, self._pipe_bytes)
        elif not reapable and not self._full:
            os.write(self._pipe, bytes(self._pipe_bytes))
        self._full = not reapable

    def _announce(self, action: str) -> None:
        """Send a message in the format of libudev's monitor to all listeners."""
        self._events += 1
        text = (
            f"ACTION={action}\nDEVPATH={DEVICE_PATH}\nSUBSYSTEM=usb\nSEQNUM={self._events}\n"
            + self._properties
        )
        properties = text.rstrip("\n").replace("\n", "\0").encode() + b"\0"
        header = b"libudev\0" + struct.pack(">I", 0xFEEDCAFE)
        header += struct.pack("<III", 40, 40, len(properties))
        header += struct.pack(">II", _murmur_hash_2(b"usb"), _murmur_hash_2(b"usb_device"))
        header += bytes(8)
        for listener in self._root.glob("event[0-9]*"):
            with socket.socket(socket.AF_UNIX, socket.SOCK_RAW) as sender:
                try:
                    sender.connect(str(listener))
                except ConnectionRefusedError:
                    continue  # left behind by a process that has ended
                sender.send(header + properties)

    # --- transfers ------------------------------------------------------------------------

    def _accept(self, listener: socket.socket) -> None:
        while True:
            try:
                connection, _ = listener.accept()
            except OSError:
                return  # withdrawn
            client = self.client_of(connection)
            with self.device.changed:
                self.clients.append(client)
            threading.Thread(target=client.serve).start()

    def _move_images(self) -> None:
        """Put images into the bulk transfers that wait for them, when they are due."""
        with self.device.changed:
            while not self._closing:
                moved = any(client.fill() for client in self.clients)
                if not moved:
                    due_s = self.device.due_s() if self.device.plugged else None
                    waiting = any(client.in_flight for client in self.clients)
                    wait_s = 1.0
                    if due_s is not None and waiting:
                        wait_s = max(0.0, due_s - self.device.clock.now_s())
                    self.device.changed.wait(wait_s)


class Client:
    """One open file descriptor of the device node.

    It outlives the device, as in usbfs, and stays dead when that is plugged in again.
    """

    def __init__(self, mount: UsbfsMount, connection: socket.socket) -> None:
        self.in_flight: dict[int, Urb] = {}
        self._mount = mount
        self._device = mount.device
        self._address = mount.device.address
        self._connection = connection
        self._completed: deque[Urb] = deque()

    @property
    def gone(self) -> bool:
        """Whether the device was unplugged since this was opened."""
        return not self._device.plugged or self._device.address != self._address

    def serve(self) -> None:
        """Answer ioctls until the file is closed."""
        try:
            while True:
                kind, request, argument = _MESSAGE.unpack(self._receive(_MESSAGE.size))
                if kind != _IOCTL:
                    self._reply(-1, errno.ENOSYS)
                    continue
                try:
                    self._reply(self._ioctl(request & 0xFFFFFFFF, argument))
                except Refused as refused:
                    self._reply(-1, refused.number)
        except (EOFError, OSError):
            pass
        finally:
            self._connection.close()
            with self._device.changed:
                if self in self._mount.clients:
                    self._mount.clients.remove(self)
                for interface, owner in tuple(self._mount.owners.items()):
                    if owner is self:
                        del self._mount.owners[interface]

    def close(self) -> None:
        """Cut the connection."""
        with suppress(OSError):  # its other end has closed it
            self._connection.shutdown(socket.SHUT_RDWR)

    def fill(self) -> bool:
        """Complete the oldest bulk transfer if an image is there; the lock is held."""
        urb = next((urb for urb in self.in_flight.values() if urb.kind == _BULK_URB), None)
        if urb is None:
            return False
        try:
            data = self._device.take(urb.length)
        except Stall:
            self.complete(urb, status=-errno.EPIPE)
        except Overflow:
            self.complete(urb, status=-errno.EOVERFLOW)
        except Unplugged:
            self.complete(urb, status=-errno.ESHUTDOWN)
        else:
            if data is None:
                return False
            urb.data, urb.actual = bytes(data), len(data)
            self.complete(urb, status=0)
        return True

    def complete(self, urb: Urb, *, status: int) -> None:
        """Let a transfer be reaped; the lock is held."""
        del self.in_flight[urb.address]
        urb.status = status
        self._completed.append(urb)
        self._show_reapable(True)

    def _show_reapable(self, reapable: bool) -> None:
        if self._device.address == self._address:  # another node stands for another address
            self._mount.show_reapable(reapable)

    # --- ioctls ---------------------------------------------------------------------------

    def _ioctl(self, request: int, argument: int) -> int:
        if request in (Ioctl.REAPURB, Ioctl.REAPURBNDELAY):
            return self._reap(argument)
        if self.gone:
            raise Refused(errno.ENODEV)
        match request:
            case Ioctl.SUBMITURB:
                self.submit(argument)
            case Ioctl.DISCARDURB:
                with self._device.changed:
                    if argument not in self.in_flight:
                        raise Refused(errno.EINVAL)
                    self.complete(self.in_flight[argument], status=-errno.ENOENT)
            case Ioctl.GET_CAPABILITIES:
                self.write_memory(argument, struct.pack("<I", CAPABILITIES))
            case Ioctl.CONTROL:
                return self._control_at_once(argument)
            case Ioctl.BULK:
                return self._bulk_at_once(argument)
            case Ioctl.CLAIMINTERFACE:
                self.claim(self._integer(argument))
            case Ioctl.DISCONNECT_CLAIM:
                claimed = self.read_memory(argument, _CLAIM.size)
                interface, flags, driver = _CLAIM.unpack(claimed)
                spared = flags & _EXCEPT_DRIVER and driver.rstrip(b"\0") == b"usbfs"
                self.claim(interface, by_force=not spared)
            case Ioctl.RELEASEINTERFACE:
                interface = self._integer(argument)
                with self._device.changed:
                    if self._mount.owners.get(interface) is self:
                        del self._mount.owners[interface]
            case Ioctl.CLEAR_HALT:
                self._device.clear_halt()
            case Ioctl.RESET:
                self._device.reset()
            case Ioctl.GET_SPEED:
                return self._mount.model.speed
            case Ioctl.GETDRIVER:
                raise Refused(errno.ENODATA)
            case Ioctl.SETCONFIGURATION | Ioctl.SETINTERFACE | Ioctl.RESETEP:
                pass
            case _:
                raise Refused(errno.ENOTTY)
        return 0

    def claim(self, interface: int, *, by_force: bool = False) -> None:
        """Have an interface; by force from another one, whose transfers end."""
        with self._device.changed:
            owner = self._mount.owners.get(interface)
            if owner not in (None, self):
                if not by_force:
                    raise Refused(errno.EBUSY)
                for urb in tuple(owner.in_flight.values()):
                    owner.complete(urb, status=-errno.ENOENT)
            self._mount.owners[interface] = self

    def control(
        self, request_type: int, request: int, value: int, index: int, length: int, data: bytes
    ) -> bytes:
        """Let the device answer a control request; one to it needs no interface."""
        answer: bytes = self._device.control(request_type, request, value, index, length, data)
        return answer

    def bulk(self, endpoint: int, length: int, data: bytes) -> bytes:
        """Let the device answer a bulk transfer at once."""
        raise Refused(errno.ENOTTY)

    def _control_at_once(self, argument: int) -> int:
        fields = _SYNCHRONOUS_CONTROL.unpack(self.read_memory(argument, _SYNCHRONOUS_CONTROL.size))
        request_type, request, value, index, length, _, buffer = fields
        sent = b"" if request_type & 0x80 else self.read_memory(buffer, length)
        try:
            answer = self.control(request_type, request, value, index, length, sent)
        except Stall:
            raise Refused(errno.EPIPE) from None
        except Unplugged:
            raise Refused(errno.ENODEV) from None
        self.write_memory(buffer, answer)
        return len(answer) if request_type & 0x80 else length

    def _bulk_at_once(self, argument: int) -> int:
        fields = _SYNCHRONOUS_BULK.unpack(self.read_memory(argument, _SYNCHRONOUS_BULK.size))
        endpoint, length, _, buffer = fields
        sent = b"" if endpoint & 0x80 else self.read_memory(buffer, length)
        answer = self.bulk(endpoint, length, sent)
        self.write_memory(buffer, answer)
        return len(answer) if endpoint & 0x80 else length

    def submit(self, address: int) -> None:
        raw = self.read_memory(address, _URB.size)
        kind, _endpoint, _status, _flags, buffer, length, *_ = _URB.unpack(raw)
        urb = Urb(address, raw, kind, buffer, length)
        if kind == _CONTROL_URB:
            self._control(urb)
            return
        self.claim(0)
        self.send_out(urb)

    def send_out(self, urb: Urb) -> None:
        """Let a transfer wait for data; it takes memory until it is reaped."""
        with self._device.changed:
            if self.gone:  # since the call began
                raise Refused(errno.ENODEV)
            held = sum(each.length for each in (urb, *self.in_flight.values(), *self._completed))
            if self._mount.memory_bytes is not None and held > self._mount.memory_bytes:
                raise Refused(errno.ENOMEM)
            self.in_flight[urb.address] = urb
            self._device.changed.notify_all()

    def _control(self, urb: Urb) -> None:
        sent = self.read_memory(urb.buffer, urb.length)
        request_type, request, value, index, length = _SETUP.unpack_from(sent)
        with self._device.changed:
            self.in_flight[urb.address] = urb
            try:
                answer = self.control(
                    request_type, request, value, index, length, sent[_SETUP.size :]
                )
            except Stall:
                self.complete(urb, status=-errno.EPIPE)
            except Unplugged:
                self.complete(urb, status=-errno.ESHUTDOWN)
            else:
                urb.data = answer
                urb.actual = len(answer) if request_type & 0x80 else length
                urb.buffer += _SETUP.size
                self.complete(urb, status=0)

    def _reap(self, argument: int) -> int:
        with self._device.changed:
            if not self._completed:
                self._show_reapable(self.gone)
                raise Refused(errno.ENODEV if self.gone else errno.EAGAIN)
            urb = self._completed.popleft()
            self._show_reapable(bool(self._completed) or self.gone)
        self.deliver(urb)
        self.write_memory(argument, struct.pack("<Q", urb.address))
        return 0

    def deliver(self, urb: Urb) -> None:
        """Write what came of a transfer into the client's memory."""
        done = bytearray(urb.raw)
        struct.pack_into("<i", done, 4, urb.status)
        struct.pack_into("<i", done, 28, urb.actual)
        self.write_memory(urb.buffer, urb.data)
        self.write_memory(urb.address, bytes(done))

    # --- the memory of the client ---------------------------------------------------------

    def _receive(self, size: int) -> bytes:
        data = bytearray(size)
        view, at = memoryview(data), 0
        while at < size:
            count = self._connection.recv_into(view[at:])
            if count == 0:
                raise EOFError
            at += count
        return bytes(data)

    def read_memory(self, address: int, size: int) -> bytes:
        self._connection.sendall(_MESSAGE.pack(_READ_MEMORY, address, size))
        return self._receive(size)

    def _integer(self, address: int) -> int:
        return int(struct.unpack("<I", self.read_memory(address, 4))[0])

    def write_memory(self, address: int, data: bytes) -> None:
        if data:
            self._connection.sendall(_MESSAGE.pack(_WRITE_MEMORY, address, len(data)) + data)

    def _reply(self, result: int, error: int = 0) -> None:
        self._connection.sendall(_MESSAGE.pack(_DONE, result & (1 << 64) - 1, error))


def _murmur_hash_2(data: bytes) -> int:
    """MurmurHash2 with seed 0, by which udev's monitor filters."""
    factor, mask = 0x5BD1E995, 0xFFFFFFFF
    value = len(data)
    whole = len(data) // 4 * 4
    for at in range(0, whole, 4):
        word = int.from_bytes(data[at : at + 4], "little") * factor & mask
        word = (word ^ word >> 24) * factor & mask
        value = value * factor & mask ^ word
    if rest := data[whole:]:
        value = (value ^ int.from_bytes(rest, "little")) * factor & mask
    value = (value ^ value >> 13) * factor & mask
    return value ^ value >> 15
