"""Checks for ``transientcam doctor``: whether cameras on USB can be reached from this machine.

Findings are tuples ``(level, check, message, remedy)``, as that verb's entry points yield them.
"""

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from transientcam_driver.camera import FoundCamera
from transientcam_driver.cameras.open_usb import UDEV_RULE, list_cameras, system_libusb
from transientcam_driver.cameras.open_usb.protocol import PRODUCT_ID, VENDOR_ID
from transientcam_driver.cli import kinect2_checks
from transientcam_driver.errors import UDEV_RULES_FILE, LibusbMissing

Reported = tuple[str, str, str, str | None]

_DEVICE_NODES: Final = "dev/bus/usb"
_RULE_DIRECTORIES: Final = (
    "etc/udev/rules.d",
    "run/udev/rules.d",
    "usr/local/lib/udev/rules.d",
    "usr/lib/udev/rules.d",
    "lib/udev/rules.d",
)
_SEATS: Final = "73-seat-late.rules"
"""The rules that give access to tagged devices; a rule that tags must come before them."""
_VENDOR = re.compile(rf'ATTRS?{{idVendor}}=="{VENDOR_ID:04x}"', re.IGNORECASE)
_PRODUCT = re.compile(rf'ATTRS?{{idProduct}}=="{PRODUCT_ID:04x}"', re.IGNORECASE)
_IN_A_CONTAINER = "in a container: -v /dev/bus/usb:/dev/bus/usb --device-cgroup-rule 'c 189:* rmw'"


def checks(
    config: Path | None = None, *, root: Path = Path("/"), backend: Any = None
) -> Iterator[Reported]:
    """Check libusb, the device nodes, the udev rule and the cameras; Kinects v2 by themselves.

    ``config``: the file of settings; no check here depends on it.
    ``root``: root of the file system.
    ``backend``: a pyusb backend; the system's libusb without one.
    """
    backend = backend or system_libusb()
    if backend is None:
        yield "warning", "libusb", str(LibusbMissing()), "simulated cameras work without it"
    else:
        yield "ok", "libusb", "found", None
    yield _device_nodes(root)
    yield _rule(root)
    if backend is not None:
        yield from map(_camera, _plugged_in(backend))
    yield from kinect2_checks.checks(root=root)


def _device_nodes(root: Path) -> Reported:
    nodes = root / _DEVICE_NODES
    if not nodes.is_dir():
        return "warning", "USB", f"there is no /{_DEVICE_NODES}", _IN_A_CONTAINER
    count = sum(1 for _ in nodes.glob("*/*"))
    return "ok", "USB", f"{count} device nodes below /{_DEVICE_NODES}", None


def _rule(root: Path) -> Reported:
    """Find the rule that lets users open a camera, where it takes effect in time."""
    for directory in _RULE_DIRECTORIES:
        for file in sorted((root / directory).glob("*.rules")):
            rule = next(filter(_is_ours, _lines(file)), None)
            if rule is None:
                continue
            shown = Path("/") / file.relative_to(root)
            if "uaccess" in rule and file.name >= _SEATS:
                message = f"{shown} comes after {_SEATS}, so that uaccess has no effect"
                return "warning", "udev rule", message, f"rename it to {UDEV_RULES_FILE}"
            return "ok", "udev rule", str(shown), None
    if os.geteuid() == 0:
        return "ok", "udev rule", "there is none, and root needs none", None
    remedy = (
        f"put this line into {UDEV_RULES_FILE}:\n  {UDEV_RULE}\n"
        "then run: udevadm control --reload && udevadm trigger"
    )
    return "warning", "udev rule", "there is none for this camera: only root can open it", remedy


def _lines(file: Path) -> list[str]:
    try:
        text = file.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return []
    return text.replace("\\\n", " ").splitlines()


def _is_ours(line: str) -> bool:
    is_rule = not line.lstrip().startswith("#")
    return is_rule and bool(_VENDOR.search(line)) and bool(_PRODUCT.search(line))


def _plugged_in(backend: Any) -> tuple[FoundCamera | None, ...]:
    return list_cameras(backend=backend) or (None,)


def _camera(camera: FoundCamera | None) -> Reported:
    if camera is None:
        return "ok", "camera", "none is plugged in", None
    if camera.problem is not None:
        problem, _, remedy = camera.problem.partition(". ")
        return "fault", "camera", f"{camera.node}: {problem}", remedy or None
    return "ok", "camera", f"{camera.spec}: {camera.product} at {camera.node}", None
