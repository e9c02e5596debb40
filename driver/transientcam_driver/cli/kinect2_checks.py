"""Checks for ``transientcam doctor``: what this machine lacks for the Kinects v2 plugged in.

Everything is read from the kernel's files, so that no camera is opened. Findings are tuples
``(level, check, message, remedy)``, as that verb's entry points yield them.
"""

import os
from collections.abc import Callable, Iterator
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
_NEEDED_MB: Final = -(-TRANSFERS * PACKETS * PACKET_BYTES // 2**20)
"""Of one camera."""


@dataclass(frozen=True, slots=True)
class Plugged:
    """A Kinect v2 as the kernel lists it."""

    node: str
    serial: str
    speed_mbit: float


def checks(*, root: Path = Path("/"), package: Callable[[], Any] = libusb) -> Iterator[Reported]:
    """Check port, permissions, memory and package; one line where none is plugged in.

    ``root``: root of the file system.
    ``package``: returns the package ``usb1``, or raises a `CameraError`.
    """
    found = tuple(_plugged_in(root))
    if not found:
        yield "ok", NAME, "none is plugged in", None
        return
    for kinect in found:
        yield from _of_one(kinect, root)
    yield _memory(root, len(found))
    try:
        package()
    except CameraError as error:
        problem, _, remedy = str(error).partition(": ")
        yield "fault", f"{NAME}: libusb", problem, remedy or None
    for rows, meaning in ROWS.items():
        default = " (without an option)" if rows == "top" else ""
        yield "ok", f"{NAME}: rows={rows}{default}", meaning, None


def _plugged_in(root: Path) -> Iterator[Plugged]:
    for folder in sorted((root / _DEVICES).glob("*")):
        try:
            ids = (int(_text(folder / name), 16) for name in ("idVendor", "idProduct"))
            vendor, product = ids
            if vendor != VENDOR_ID or product not in PRODUCT_IDS:
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
        yield "fault", NAME, message, "plug it into a USB 3 port, without a hub"
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
