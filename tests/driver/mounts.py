"""Three ways to a camera: pyusb's backend in this process, real usbfs calls, and a real device."""

import errno
import time
from contextlib import ExitStack
from typing import Any, Protocol

import usb.core

from tests.driver.cameras.open_usb.usbfs.processes import Program, emulated_camera
from transientcam_driver import Camera, CameraLost, CameraNotFound, Sequence, open_camera
from transientcam_driver.cameras.open_usb import UsbCamera, open_transport
from transientcam_driver.cameras.open_usb.protocol import STATUS_BYTES, Request, unpack_status
from transientcam_driver.clock import VirtualClock
from transientcam_simulation.emulated import build, find_scene, without_noise
from transientcam_simulation.emulated._open_usb.bus import SimulatedBus
from transientcam_simulation.emulated._open_usb.faults import Fault


class Mount(Protocol):
    """What a test may do with a camera, and let happen to it."""

    emulated: bool

    def open(self, spec: str = "usb", sequence: Sequence | None = None) -> Camera: ...

    def another_program(self) -> None:
        """Try to open the camera as another program would."""

    def wait(self) -> None:
        """Give the event of a plug the time to arrive."""

    @property
    def lit(self) -> bool: ...

    def do(self, command: str, *arguments: Any) -> None:
        """Let something happen: unplug, replug, halt, expect, stall, interlock, memory."""

    def restore(self) -> None:
        """Undo what a test has done."""

    def close(self) -> None: ...


class _ShortOfMemory(SimulatedBus):
    """A bus whose host has little memory for transfers."""

    memory_bytes: int | None = None

    def bulk_read(self, dev_handle: Any, ep: int, intf: int, buff: Any, timeout: int) -> int:
        if self.memory_bytes is not None and len(buff) > self.memory_bytes:
            raise usb.core.USBError("Insufficient memory", -11, errno.ENOMEM)
        return super().bulk_read(dev_handle, ep, intf, buff, timeout)


class PyusbMount:
    """The emulated device as a backend of pyusb, in virtual time."""

    emulated = True

    def __init__(self) -> None:
        self._clock = VirtualClock(start_s=1000.0, unix_s=1.7e9)
        scene = without_noise(find_scene("wall"))
        self._device, _ = build(scene, width=163, height=120, seed=1, clock=self._clock)
        self._bus = _ShortOfMemory([self._device])
        self._opened = ExitStack()

    def open(self, spec: str = "usb", sequence: Sequence | None = None) -> Camera:
        of_spec = spec.partition(":")[2] or None
        camera = UsbCamera(
            lambda serial: open_transport(serial or of_spec, backend=self._bus),
            clock=self._clock,
            sequence=sequence,
        )
        return self._opened.enter_context(camera)

    def another_program(self) -> None:
        self.open().close()

    def wait(self) -> None:
        pass

    @property
    def lit(self) -> bool:
        status = self._device.control(0xC0, Request.GET_STATUS, 0, 0, STATUS_BYTES, b"")
        return unpack_status(status).light_on

    def do(self, command: str, *arguments: Any) -> None:
        match command, arguments:
            case "unplug", ():
                self._device.unplug()
            case "replug", ():
                self._device.replug()
            case "halt", ():
                self._device.halt()
            case "inject", (fault, images):
                self._device.inject(Fault(fault), images)
            case "stall", (requests,):
                self._device.stall_next(requests)
            case "interlock", (closed,):
                self._device.set_interlock(closed=closed)
            case "memory", (memory_bytes,):
                self._bus.memory_bytes = memory_bytes
            case _:
                raise AssertionError(command)

    def restore(self) -> None:
        self._opened.close()
        self._device.unplug()
        self._device.replug()
        self._bus.memory_bytes = None

    def close(self) -> None:
        pass


class UsbfsMount:
    """The emulated device behind usbfs: pyusb and libusb are the real ones."""

    emulated = True

    def __init__(self) -> None:
        self._life = ExitStack()
        self._camera = self._life.enter_context(emulated_camera())
        self._program = self._start()
        self._opened = ExitStack()

    def _start(self) -> Program:
        program = Program(self._camera.environment)
        self._life.callback(program.close)
        return program

    def open(self, spec: str = "usb", sequence: Sequence | None = None) -> Camera:
        return self._opened.enter_context(self._program.open(spec, sequence))

    def another_program(self) -> None:
        other = Program(self._camera.environment, spare=50)
        try:
            other.open().close()
        finally:
            other.close()

    def wait(self) -> None:
        time.sleep(0.02)

    @property
    def lit(self) -> bool:
        return self._camera.lit

    def do(self, command: str, *arguments: Any) -> None:
        self._camera.do(command, *arguments)

    def restore(self) -> None:
        self._opened.close()
        self._camera.do("memory", None)
        self._camera.do("unplug")
        self._camera.do("replug")
        for _ in range(500):  # libusb is notified of the plug by udev's monitor
            try:
                self._program.open().close()
            except (CameraNotFound, CameraLost):
                self.wait()
            else:
                return
        raise AssertionError("the camera does not come back")

    def close(self) -> None:
        self._life.close()


class RealMount:
    """A camera that is plugged in; its cable stays in."""

    emulated = False

    def __init__(self) -> None:
        self._opened = ExitStack()
        self._camera: Camera | None = None

    def open(self, spec: str = "usb", sequence: Sequence | None = None) -> Camera:
        self._camera = self._opened.enter_context(open_camera(spec))
        if sequence is not None:
            self._camera.configure(sequence)
        return self._camera

    def another_program(self) -> None:
        open_camera("usb").close()

    def wait(self) -> None:
        pass

    @property
    def lit(self) -> bool:
        assert self._camera is not None
        return self._camera.status().light_on

    def do(self, command: str, *arguments: Any) -> None:
        raise AssertionError(f"{command} does not happen to a real camera")

    def restore(self) -> None:
        self._opened.close()

    def close(self) -> None:
        pass
