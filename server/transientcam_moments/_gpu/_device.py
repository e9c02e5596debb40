"""The side of a device that runs in a process of its own: adapters, buffers, dispatches.

wgpu-native ends the process at a bad submit (wgpu-native#588), and so may a driver at any time. All
functions are called through `ChildProcess`, one at a time; what they were told stays in `_HERE`.
"""

import mmap
import os
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

import numpy as np

from transientcam_moments._gpu._shader import GROUP, ROW

SOFTWARE: Final = "CPU"
_RANK: Final = {"DiscreteGPU": 0, "IntegratedGPU": 1, "VirtualGPU": 2, SOFTWARE: 4}
_BACKENDS: Final = ("Vulkan", "Metal", "DX12")


class Adapter(NamedTuple):
    """A device that there is, by what its driver says of it."""

    name: str
    kind: str
    """DiscreteGPU, IntegratedGPU, VirtualGPU, CPU (software) or Unknown."""
    backend: str
    """Vulkan, Metal or D3D12."""
    driver: str
    refused: str = ""
    """What it makes wrong of a known frame; "" where it is right, or was not checked."""


_BINDINGS: Final = {
    "measure": (0, 1, 2, 4, 5, 6, 7),
    "analyse": (0, 3, 6, 7),
    "estimate": (0, 6, 7),
}
"""Of the entries of shaders."""
_HERE: Final[Any] = SimpleNamespace(device=None, room=None, passes={}, pipelines={})
"""What this process keeps: a device, shared memory, passes by key, and pipelines by their text."""


def told(function: Callable[..., Any], *arguments: Any) -> Any:
    """Return what a function does; whatever it raises is told in words, as nobody else has wgpu."""
    try:
        return function(*arguments)
    except Exception as error:
        raise RuntimeError(f"{type(error).__name__}: {error}".splitlines()[0]) from None


def adapters(_tell: object) -> list[Adapter]:
    """Return the adapters of this machine, real GPUs first."""
    return [each for each, _ in _adapters()]


def _adapters() -> list[tuple[Adapter, Any]]:
    import wgpu  # type: ignore[import-untyped]  # it has no marker
    from wgpu.backends.wgpu_native.extras import set_instance_extras  # type: ignore[import-untyped]

    # else drivers complain on the terminal that there is no display
    os.environ.setdefault("XDG_RUNTIME_DIR", tempfile.gettempdir())
    if _HERE.device is None:  # OpenGL's drivers look for displays, which there may not be
        with suppress(RuntimeError):  # it is asked once more
            set_instance_extras(backends=_BACKENDS)
    found = []
    for each in wgpu.gpu.enumerate_adapters_sync():
        info = each.info
        named = info["device"], info["adapter_type"], info["backend_type"], info["description"]
        found.append((Adapter(*named), each))
    return sorted(found, key=lambda each: _RANK.get(each[0].kind, 3))


def take(adapter: Adapter, _tell: object) -> int:
    """Take an adapter's device; return how many bytes one of its buffers may have."""
    raw = next(each for found, each in _adapters() if found == adapter)
    limits = raw.limits
    most: int = min(limits["max-storage-buffer-binding-size"], limits["max-buffer-size"], 2**31 - 4)
    wanted = {"max-storage-buffer-binding-size": most, "max-buffer-size": most}
    _HERE.device = raw.request_device_sync(required_limits=wanted)
    return most


def share(path: str, _tell: object) -> None:
    """Take the memory by which frames come and go; the file is not needed afterwards."""
    with open(path, "r+b") as file:  # noqa: PTH123 - it is mapped by its number
        _HERE.room = mmap.mmap(file.fileno(), 0)


def prepare(
    key: int, code: str, inputs: Sequence[Any], sizes: tuple[int, int, int, int], _tell: object
) -> None:
    """Make ready to compute frames that are alike.

    ``inputs``: what stays from frame to frame: params, inverse, weights, places of the bindings.
    ``sizes``: bytes of raw images, replaced moments, calibrated moments and results.
    """
    import wgpu

    device, usage = _HERE.device, wgpu.BufferUsage
    if code not in _HERE.pipelines:
        _HERE.pipelines[code] = _pipelines(code)
    static = [
        device.create_buffer_with_data(
            data=np.ascontiguousarray(each), usage=usage.STORAGE if at else usage.UNIFORM
        )
        for at, each in enumerate(inputs)
    ]
    into = usage.STORAGE | usage.COPY_DST
    raw, replaced, moments, out = (
        device.create_buffer(size=max(size, 16), usage=into | usage.COPY_SRC) for size in sizes
    )
    params, inverse, weights, places = static
    buffers = [params, raw, inverse, weights, places, replaced, moments, out]
    entries = []
    for pipeline, bindings in _HERE.pipelines[code]:
        bind = device.create_bind_group(
            layout=pipeline.get_bind_group_layout(0),
            entries=[{"binding": at, "resource": {"buffer": buffers[at]}} for at in bindings],
        )
        entries.append((pipeline, bind))
    pixels = int(inputs[0][0]) * int(inputs[0][1])
    _HERE.passes[key] = entries, buffers, sizes, pixels


def _pipelines(code: str) -> list[tuple[Any, tuple[int, ...]]]:
    device = _HERE.device
    module = device.create_shader_module(code=code)
    found: list[tuple[Any, tuple[int, ...]]] = []
    for name, bindings in _BINDINGS.items():
        if f"fn {name}(" in code:
            stage = {"module": module, "entry_point": name}
            pipeline = device.create_compute_pipeline(layout="auto", compute=stage)
            found.append((pipeline, bindings))
    return found


def forget(key: int, _tell: object) -> None:
    """Give back what `prepare` took."""
    _HERE.passes.pop(key, None)


def run(key: int, _tell: object) -> None:
    """Compute a frame from the shared memory into it.

    It holds raw images and replaced moments, or moments that are smoothed, one behind the other.
    """
    entries, buffers, sizes, pixels = _HERE.passes[key]
    device, room = _HERE.device, _HERE.room
    at = 0
    # where there are raw images, moments are computed of them
    given = (1, 0), (5, 1), (6, 2)
    for buffer, size in given[:2] if sizes[0] else given[2:]:
        if sizes[size]:
            device.queue.write_buffer(buffers[buffer], 0, memoryview(room)[at : at + sizes[size]])
            at += sizes[size]
    encoder = device.create_command_encoder()
    across = min(-(-pixels // GROUP), ROW // GROUP)
    for pipeline, bind in entries:
        one = encoder.begin_compute_pass()
        one.set_pipeline(pipeline)
        one.set_bind_group(0, bind)
        one.dispatch_workgroups(across, -(-pixels // ROW))
        one.end()
    device.queue.submit([encoder.finish()])
    room[: sizes[3]] = device.queue.read_buffer(buffers[7], 0, sizes[3])
