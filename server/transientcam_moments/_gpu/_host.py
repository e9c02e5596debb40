"""A device of this machine, in a process of its own: whatever it does, this one goes on.

A frame that the device does not give is one that the processor computes. A device that computes
known frames wrongly, or fails again and again, is asked no more.
"""

import math
import mmap
import os
import tempfile
import threading
import time
import weakref
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import lru_cache, partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, TypedDict

import numpy as np

from transientcam_compiled import ChildProcess, empty
from transientcam_moments._dispatch import LEAST_PIXELS, Key, lookup
from transientcam_moments._gpu import _device as there
from transientcam_moments._gpu._device import SOFTWARE, Adapter
from transientcam_moments._gpu._golden import wrong, wrong_kernel
from transientcam_moments._gpu._kernels import ARRANGED, DeviceKernel, asked
from transientcam_moments._gpu._passes import DevicePass
from transientcam_moments._kernels.one_pass import Constants
from transientcam_moments.arrays import Array
from transientcam_moments.errors import DeviceUnavailable, ParameterError

_ROUNDS: Final = 3
"""Frames that "auto" measures on device and processor each; the first of each does not count."""
_MOST_ROOTS: Final = 8
_KEPT: Final = 4
"""Kinds of frames whose likelihoods and films are kept prepared."""
_FAILURES: Final = 3
"""In a row, after which a device is asked no more."""
_ASKS: Final = 480
"""Times that a call is asked whether it goes on, four a second, until the device hangs."""
_MEMORY_BYTES: Final = 1 << 40
"""Drivers take much room that they do not use."""
_Prepared = DevicePass | DeviceKernel


class DeviceState(TypedDict):
    """What a device is, and how often its results were used."""

    wanted: str
    name: str | None
    """Of the adapter; None until one was looked for, or where there is none."""
    results: dict[str, int]
    """By what computed them, of those that the device was asked for: "device" or "processor"."""
    refused: str | None
    """Why nothing, or not everything, is computed there."""


class Device:
    """One adapter, by its name or as the first real GPU; several threads may use it.

    ``wanted``: "gpu", or "gpu:" and a part of an adapter's name, which may be of software.
    ``hostile``: have shaders spoilt, see `shader`.
    """

    def __init__(self, wanted: str = "gpu", *, hostile: bool = False) -> None:
        self.wanted, self._hostile = wanted, hostile
        self.adapter: Adapter | None = None
        self._named = wanted.partition(":")[2]
        # a child process is for one thread
        self._thread = ThreadPoolExecutor(1, "transientcam-kernel-device")
        self._child = ChildProcess(memory_bytes=_MEMORY_BYTES, nice=0)
        self._lock = threading.Lock()
        self._checks: dict[tuple[str, int], Future[str]] = {}
        self._kernels: dict[tuple[Any, ...], DeviceKernel] = {}
        self._failures, self.failed, self._reason = 0, "", ""
        self._results = {"device": 0, "processor": 0}
        self._most_bytes = 0
        self._keys: set[int] = set()
        self._dropped: list[int] = []
        self._room: mmap.mmap | None = None
        self._open = False

    def adapters(self) -> list[Adapter]:
        """Return what there is. Raises DeviceUnavailable where that cannot be found out."""
        try:
            found: list[Adapter] = self._thread.submit(self._adapters).result()
        except (OSError, RuntimeError) as error:
            raise DeviceUnavailable(self.wanted, str(error)) from None
        return found

    def require(self, m: int) -> None:
        """Wait until frames of an order have been checked; with 0, until there is a device.

        Raises DeviceUnavailable where there is no such device, or where it is wrong.
        """
        reason = self._check("pass", m).result()
        if reason:
            raise DeviceUnavailable(self.wanted, reason)

    def is_ready(self, m: int, kind: str = "pass") -> bool:
        """Say whether passes or a kernel of an order were found right; else that begins now."""
        check = self._check(kind, m)
        return check.done() and not check.result() and not self._reason

    def prepare(
        self, m: int, shape: tuple[int, ...], constants: Constants, *, images: bool
    ) -> DevicePass | None:
        """Return the pass for frames that are alike; None where the device does not take them."""
        if not 1 <= m <= _MOST_ROOTS or self._reason:
            return None
        made = DevicePass(self.frame, m, shape, constants, images=images, hostile=self._hostile)
        return None if max(made.sizes) > self._most_bytes else made

    def frame(self, one: _Prepared, given: Sequence[Array]) -> Any:
        """Return the results of a frame, float32 (n, P); None where the device failed."""
        found = self._thread.submit(self._frame, one, given).result()
        with self._lock:
            self._results["processor" if found is None else "device"] += 1
        return found

    def state(self) -> "DeviceState":
        """Say what it is and what it has done."""
        checks = [check.result() for check in list(self._checks.values()) if check.done()]
        return {
            "wanted": self.wanted,
            "name": None if self.adapter is None else self.adapter.name,
            "results": dict(self._results),
            "refused": next(filter(None, [*checks, self._reason]), None),
        }

    def kernel(self, name: str, m: int, *given: Any) -> Any:
        """Compute what the kernel of that name does of the same arguments.

        None where the device does not take them, fails, or is wrong with that kernel and order.
        """
        usual = name in ARRANGED and given[0].dtype == np.complex64
        if not usual or given[0].shape[1] < LEAST_PIXELS or m > _MOST_ROOTS or self._reason:
            return None
        refused = self._check(name, m).result()
        return None if refused else self._asked(self.frame, name, m, *given)

    def _asked(self, frame: Callable[..., Any], name: str, m: int, *given: Any) -> Any:
        wanted = asked(name, given)
        key = name, m, given[0].shape[1], *wanted[1:]
        with self._lock:
            if key not in self._kernels:
                while len(self._kernels) >= _KEPT:
                    self._kernels.pop(next(iter(self._kernels)))
                self._kernels[key] = DeviceKernel(*key[:3], wanted, hostile=self._hostile)
            one = self._kernels[key]
        served = one.sizes[3] > 0 and max(one.sizes) <= self._most_bytes
        found = frame(one, [wanted.data]) if served else None
        return None if found is None else ARRANGED[name](found, *given)

    def close(self) -> None:
        """End its process."""
        self._thread.submit(self._end).result()
        self._thread.shutdown()

    # -- on its thread -------------------------------------------------------------------------

    def _check(self, kind: str, m: int) -> "Future[str]":
        with self._lock:
            if (kind, m) not in self._checks:
                self._checks[kind, m] = self._thread.submit(self._checked, kind, m)
            return self._checks[kind, m]

    def _checked(self, kind: str, m: int) -> str:
        """Return what is wrong with frames of an order; nothing, if they are right."""
        try:
            self._begin()
        except (OSError, RuntimeError) as error:
            self._end()
            return str(error)
        assert self.adapter is not None  # noqa: S101 - it has begun
        if not m:
            return ""

        def make(*given: Any) -> DevicePass:
            return DevicePass(self._frame, *given, images=True, hostile=self._hostile)

        self.failed = ""
        compute = partial(self._asked, self._frame, kind, m)
        found = wrong(m, make) if kind == "pass" else wrong_kernel(kind, m, compute)
        if self.failed:
            return f"{self.adapter.name} failed: {self.failed}"
        return f"{self.adapter.name} computes known frames wrongly: {found}" if found else ""

    def _begin(self) -> None:
        """Start the process with its device, unless it is there."""
        if self._open:
            return
        self.adapter = self._chosen(self._adapters())
        self._most_bytes = self._call(there.take, self.adapter)
        self._open = True

    def _adapters(self) -> list[Adapter]:
        if find_spec("wgpu") is None:
            raise RuntimeError("wgpu is not installed: pip install 'transientcam[gpu]'")
        found: list[Adapter] = self._call(there.adapters)
        return found

    def _chosen(self, found: list[Adapter]) -> Adapter:
        named = [each for each in found if self._named.lower() in each.name.lower()]
        real = [each for each in named if self._named or each.kind != SOFTWARE]
        if real:
            return real[0]
        names = ", ".join(each.name for each in found)
        if self._named:
            raise RuntimeError(f"no adapter has that name; there are: {names or 'none'}")
        raise RuntimeError(
            f"{names} computes on the processor" if names else "no adapter was found"
        )

    def _frame(self, one: _Prepared, given: Sequence[Array]) -> Any:
        if self._reason:
            return None
        try:
            self._begin()
            found = self._computed(one, given)
        except (OSError, RuntimeError, MemoryError) as error:
            self._end()
            self._failures += 1
            self.failed = str(error)
            if self._failures >= _FAILURES:
                self._reason = f"it failed {_FAILURES} times in a row: {self.failed}"
            return None
        self._failures = 0
        return found

    def _computed(self, one: _Prepared, given: Sequence[Array]) -> Any:
        room = self._shared(max(sum(one.sizes[:2]) or one.sizes[2], one.sizes[3]))
        while self._dropped:
            self._call(there.forget, self._dropped.pop())
        if one.key not in self._keys:
            self._call(there.prepare, one.key, one.code, one.inputs, one.sizes)
            self._keys.add(one.key)
            weakref.finalize(one, self._dropped.append, one.key)
        at = 0
        for each in given:
            bytes_ = np.ascontiguousarray(each).reshape(-1).view(np.uint8)
            np.frombuffer(room, np.uint8, bytes_.size, at)[:] = bytes_
            at += one.sizes[0] if len(given) > 1 else 0
        self._call(there.run, one.key)
        out = empty((one.sizes[3] // (4 * one.pixels), one.pixels), np.float32)
        out[...] = np.frombuffer(room, np.float32, out.size).reshape(out.shape)
        return out

    def _shared(self, size: int) -> mmap.mmap:
        """Return memory of at least so many bytes that both processes see."""
        if self._room is None or len(self._room) < size:
            # memory where there is such a directory; never larger than what it has room for
            fast = Path("/dev/shm")  # noqa: S108 - nobody else can open what is made there
            with tempfile.NamedTemporaryFile(dir=fast if fast.is_dir() else None) as file:
                os.posix_fallocate(file.fileno(), 0, size)
                room = mmap.mmap(file.fileno(), size)
                self._call(there.share, file.name)
            self._room = room
        return self._room

    def _call(self, function: Callable[..., Any], *arguments: object) -> Any:
        asks = iter(range(_ASKS))

        def ask() -> None:
            if next(asks, None) is None:
                raise OSError("it hangs")

        return self._child.call(there.told, function, *arguments, ask=ask)

    def _end(self) -> None:
        self._open, self._room = False, None
        self._keys.clear()
        self._child.end()


class Race:
    """For each kind of frame, device or processor, whichever computed the first ones faster."""

    def __init__(self, clock_s: Callable[[], float] = time.perf_counter) -> None:
        self._clock_s = clock_s
        self._lock = threading.Lock()
        self._took_s: dict[Any, tuple[list[float], list[float]]] = {}

    def run(self, kind: Any, there: Callable[[], Any], here: Callable[[], Any]) -> Any:
        """Return what a device gives, or else the processor; both take turns at first.

        ``there`` returns None where the device failed.
        """
        with self._lock:
            device_s, processor_s = times = self._took_s.setdefault(kind, ([], []))
            if min(len(device_s), len(processor_s)) < _ROUNDS:
                on_device = len(device_s) <= len(processor_s)
            else:
                on_device = min(device_s[1:]) < min(processor_s[1:])
        begin_s = self._clock_s()
        found = (there if on_device else here)()
        took_s = self._clock_s() - begin_s if found is not None else math.inf
        with self._lock:
            took = times[not on_device]
            if len(took) < _ROUNDS:
                took.append(took_s)
        return here() if found is None else found


class Choice:
    """What computes: a device, the processor (None), or of "auto" whichever is faster."""

    def __init__(self, device: Device | None, *, automatic: bool) -> None:
        self.device, self.automatic, self.race = device, automatic, Race()

    def device_for(self, m: int, kind: str = "pass") -> Device | None:
        """Return the device for frames of an order, if there is one; "auto" waits for no check."""
        if self.device is None or m > _MOST_ROOTS:
            return None
        if not self.automatic:
            self.device.require(m)
            return self.device
        return self.device if self.device.is_ready(m, kind) else None

    def kernel(self, name: str, m: int, *given: Any, here: Callable[[], Any]) -> Any:
        """Compute what a kernel does where that is chosen; has the face of `Elsewhere`."""
        device = self.device_for(m, name) if name in ARRANGED else None
        if device is None:
            return here()
        there = partial(device.kernel, name, m, *given)
        rival = lookup(name, m, given[0].shape[1]) or not Key.of(name, m, "f").is_offered
        if self.automatic and rival:  # alike are those of about the same size
            sizes = (np.size(each).bit_length() for each in given)
            return self.race.run((name, m, *sizes), there, here)
        found = there()
        return here() if found is None else found


@lru_cache(maxsize=8)
def device_of(name: str) -> Device | None:
    """Return this process's device of a reconstructor's ``device``; None for the processor.

    Raises ParameterError for another name.
    """
    if name not in ("cpu", "auto", "gpu") and not name.startswith("gpu:"):
        raise ParameterError("device", name, "cpu, auto, gpu or gpu:NAME")
    if name == "auto":
        return device_of("gpu")
    return None if name == "cpu" else Device(name)


CHOICE: Final = ["cpu"]
"""What reconstructors of this process use that are given no device."""
