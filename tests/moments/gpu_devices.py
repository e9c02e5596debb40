"""Software devices for tests: two drivers of Vulkan, whose compilers share nothing."""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import pytest

import transientcam_moments as tm
from transientcam_moments._gpu import Device, DevicePass, _host
from transientcam_moments._gpu._kernels import DeviceKernel

DRIVERS: Final = {
    "llvmpipe": "/usr/share/vulkan/icd.d/lvp_icd.x86_64.json",  # of mesa-vulkan-drivers
    "SwiftShader": "/usr/lib/chromium/vk_swiftshader_icd.json",  # beside Chromium
}


class CountingDevice(Device):
    """A device that counts the frames that it gave."""

    frames = 0

    def frame(self, one: DevicePass | DeviceKernel, given: Sequence[Any]) -> Any:
        found = super().frame(one, given)
        self.frames += found is not None
        return found


@contextmanager
def software_device(name: str, *, hostile: bool = False) -> Iterator[CountingDevice]:
    """Have a device of a driver inside; skips where it is not installed."""
    reason = _missing(name)
    if reason:
        pytest.skip(reason)
    with _only(name), pytest.MonkeyPatch.context() as patch:
        patch.setattr(_host, "_ASKS", 1 << 20)  # a laden machine may take long to compile
        device = CountingDevice(f"gpu:{name}", hostile=hostile)
        try:
            device.adapters()  # starts its process
            yield device
        finally:
            device.close()


@lru_cache
def _missing(name: str) -> str:
    """Say why there is no such device; nothing where there is."""
    if not Path(DRIVERS[name]).exists():
        return f"{name} is not installed: {DRIVERS[name]}"
    with _only(name):
        device = Device(f"gpu:{name}")
        try:
            found = device.adapters()
        except tm.DeviceUnavailable as error:
            return str(error)
        finally:
            device.close()
    return "" if any(name in each.name for each in found) else f"no adapter is of {name}"


@contextmanager
def _only(name: str) -> Iterator[None]:
    """Have processes that begin inside see one driver."""
    before = os.environ.get("VK_DRIVER_FILES")
    os.environ["VK_DRIVER_FILES"] = DRIVERS[name]
    try:
        yield
    finally:
        if before is None:
            del os.environ["VK_DRIVER_FILES"]
        else:
            os.environ["VK_DRIVER_FILES"] = before
