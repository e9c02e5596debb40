"""Checks for ``transientcam doctor`` and ``transientcam kinect2``: what a Kinect v2 needs.

Everything is read from the kernel's files, so that no camera is opened. Findings are tuples
``(level, check, message, remedy)``, as that verb's entry points yield them.
"""

import os
from collections.abc import Callable, Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from transientcam_driver.cameras.kinect2 import (
    PACKET_BYTES,
    PACKETS,
    PRODUCT_IDS,
    ROWS,
    TRANSFERS,
    UDEV_RULES,
    VENDOR_ID,
    libusb,
)
from transientcam_driver.errors import UDEV_RULES_FILE, CameraError

Reported = tuple[str, str, str, str | None]

NAME: Final = "Kinect v2"
_DEVICES: Final = "sys/bus/usb/devices"
_MEMORY: Final = "sys/module/usbcore/parameters/usbfs_memory_mb"
_SUPER_SPEED_MBIT: Final = 5000.0
_HUB_ID: Final = 0x02D9
"""Of the hub within a Kinect, which is also there without power or USB 3 (libfreenect2#186)."""
_CABLE: Final = "use a USB 3 port, without a hub, and a cable with the wires of USB 3"
_CARD: Final = "add a PCIe card with a controller by Renesas"
_ASMEDIA: Final = 0x1B21
_WORKING: Final = {0x8086: "Intel", 0x1033: "NEC", 0x1912: "Renesas"}
"""By vendor, as libfreenect2's README has it; Renesas took over NEC's."""
_NEEDED_MB: Final = -(-TRANSFERS * PACKETS * PACKET_BYTES // 2**20)
"""Of one camera."""


@dataclass(frozen=True, slots=True)
class Plugged:
    """A Kinect v2 as the kernel lists it."""

    node: str
    serial: str
    speed_mbit: float


def checks(
    *, root: Path = Path("/"), package: Callable[[], Any] = libusb, host: bool = False
) -> Iterator[Reported]:
    """Check host, port, permissions, memory and package; one line where none is plugged in.

    ``root``: root of the file system.
    ``package``: returns the package ``usb1``, or raises a `CameraError`.
    ``host``: whether to check the host and its package without any, too.
    """
    found = tuple(_plugged_in(root, PRODUCT_IDS))
    if not found and (hubs := [*_plugged_in(root, (_HUB_ID,))]):
        message = f"its hub is at {hubs[0].node}, but no camera behind it"
        yield "fault", NAME, message, f"plug in its power supply; {_CABLE}"
    elif not found:
        yield "ok", NAME, "none is plugged in", None
    if not found and not host:
        return
    yield from _of_host(root)
    for kinect in found:
        yield from _of_one(kinect, root)
    yield _memory(root, max(1, len(found)))
    try:
        package()
    except CameraError as error:
        problem, _, remedy = str(error).partition(": ")
        yield "fault", f"{NAME}: libusb", problem, remedy or None
    for rows, meaning in ROWS.items():
        default = " (without an option)" if rows == "top" else ""
        yield "ok", f"{NAME}: rows={rows}{default}", meaning, None


def of_host(root: Path) -> Iterator[Reported]:
    """Check the host as well where no Kinect is plugged in."""
    return checks(root=root, host=True)


def _of_host(root: Path) -> Iterator[Reported]:
    """Judge the host's USB 3 controllers, by what owners told the authors of libfreenect2."""
    check, fast = f"{NAME}: controller", False
    for bus in sorted((root / _DEVICES).glob("usb*")):
        try:
            if float(_text(bus / "speed")) < _SUPER_SPEED_MBIT:
                continue
            vendor = int(_text(bus.resolve().parent / "vendor"), 16)
        except (OSError, ValueError):  # of no PCI device
            vendor = 0
        fast = True
        by = _WORKING.get(vendor, f"vendor {vendor:04x}")
        if vendor == _ASMEDIA:
            yield "warning", check, f"{bus.name}: ASMedia, frames are lost with it", _CARD
        else:
            known = "known to work" if vendor in _WORKING else "few reports are known"
            yield "ok", check, f"{bus.name}: {by}, {known}", None
    if not fast:
        yield "fault", check, "this machine has no USB 3", _CARD
    with suppress(OSError):
        if "hypervisor" in _text(root / "proc/cpuinfo"):
            message = "a virtual machine: frames are often lost on a device passed through"
            yield "warning", f"{NAME}: host", message, "pass the whole USB controller through"


def _plugged_in(root: Path, products: Collection[int]) -> Iterator[Plugged]:
    for folder in sorted((root / _DEVICES).glob("*")):
        try:
            ids = (int(_text(folder / name), 16) for name in ("idVendor", "idProduct"))
            vendor, product = ids
            if vendor != VENDOR_ID or product not in products:
                continue
            bus, address = (int(_text(folder / name)) for name in ("busnum", "devnum"))
            speed_mbit = float(_text(folder / "speed"))
        except (OSError, ValueError):  # an interface, or unplugged meanwhile
            continue
        serial = _text(folder / "serial") if (folder / "serial").is_file() else ""
        yield Plugged(f"/dev/bus/usb/{bus:03d}/{address:03d}", serial, speed_mbit)


def _of_one(kinect: Plugged, root: Path) -> Iterator[Reported]:
    name = f"kinect2:{kinect.serial}" if kinect.serial else "kinect2"
    if kinect.speed_mbit < _SUPER_SPEED_MBIT:
        message = f"{name} at {kinect.node} is on a port with {kinect.speed_mbit:g} Mbit/s"
        yield "fault", NAME, message, _CABLE
    else:
        yield "ok", NAME, f"{name} at {kinect.node}, {kinect.speed_mbit:g} Mbit/s", None
    if not os.access(root / kinect.node[1:], os.R_OK | os.W_OK):
        remedy = (
            f"put these lines into {UDEV_RULES_FILE}:\n  {UDEV_RULES}\n"
            "then run: udevadm control --reload && udevadm trigger, and plug it in again"
        )
        yield "fault", f"{NAME}: permission", f"this user may not open {kinect.node}", remedy


def _memory(root: Path, cameras: int) -> Reported:
    """Compare what usbfs may hold with what the transfers of all cameras need."""
    needed_mb = _NEEDED_MB * cameras
    check = f"{NAME}: usbfs_memory_mb"
    try:
        allowed_mb = int(_text(root / _MEMORY))
    except (OSError, ValueError):
        return "warning", check, f"/{_MEMORY} cannot be read; {needed_mb} MB are needed", None
    if allowed_mb == 0:  # no limit
        return "ok", check, "without a limit", None
    message = f"{allowed_mb} MB, of which {needed_mb} are needed"
    if allowed_mb >= needed_mb:
        return "ok", check, message, None
    remedy = f"echo {4 * needed_mb} | sudo tee /{_MEMORY}"
    return "fault", check, message, f"{remedy} (usbcore.usbfs_memory_mb= on the kernel's line)"


def _text(file: Path) -> str:
    return file.read_text(encoding="ascii", errors="replace").strip()
