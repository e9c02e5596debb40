"""Compiled kernels for the hot algorithms: what is ready, and how to make it ready.

Nothing has to be called. Every algorithm runs on NumPy and gives the same results; from the first
call with 4096 pixels or more on, the kernel that would have served it is loaded from the cache
(half a second) on a thread that no call waits for, and later calls change over to it. What is not
in the cache is compiled into it first (seconds, once on a machine), by a process of low priority,
or by that thread where there can be none. `compile` makes kernels ready beforehand, and waits for
them.

A process that ends meanwhile waits for no kernel, or at most for the one that is being compiled by
its thread. The environment variable ``TRANSIENTCAM_KERNELS=off`` leaves everything to NumPy,
``TRANSIENTCAM_KERNELS=manual`` compiles only what `compile` is called for. Compiled code is kept
for the next process in ``NUMBA_CACHE_DIR``, else in ``transientcam/kernels`` below
``XDG_CACHE_HOME`` or ``~/.cache``, else (nothing there can be written to) not at all.

`density`, `levinson`, `pisarenko` and `reconstruct` use all cores, or as many threads as their
``threads`` says. A program that makes such calls on threads of its own calls `use_one_thread` on
each of these, and `use_all_cores` for what is urgent.
"""

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TypedDict

from transientcam_compiled import (
    THREAD,
    Spread,
    at_once,
    over,
    over_all_cores,
    use_all_cores,
    use_one_thread,
)
from transientcam_moments import _gpu
from transientcam_moments._dispatch import (
    CACHE,
    EVERYWHERE,
    KERNELS,
    LEAST_PIXELS,
    MOST_ROOTS,
    PRECISION_NAMES,
    Kernel,
    Key,
    lookup,
)
from transientcam_moments.arrays import MAX_HARMONICS, chosen
from transientcam_moments.errors import DeviceUnavailable, ParameterError

__all__ = [
    "LANES", "MOST_ROOTS", "THREAD", "Progress", "Spread", "State", "at_once", "cache_directory",
    "compile", "device_state", "devices", "load", "make_ready", "only_note", "over",
    "over_all_cores", "prepare", "preparing", "ready", "settled", "state", "use_all_cores",
    "use_device", "use_one_thread",
]  # fmt: skip

LANES = (
    "pisarenko", "smallest_eigenvalue", "smooth", "neighbours", "measure", "separate", "levinson",
    "density", "peaks", "reconstruct", "likelihood", "pairs", "harmonics", "covariance",
    "direct_noise",
)  # fmt: skip
Progress = Callable[[int, int, str], None]
"""Takes kernels done, kernels in all, and the name of the next one ("" after the last)."""


class State(TypedDict):
    """What `state` returns."""

    enabled: bool
    compiled: list[str]
    compiling: str | None
    failed: list[str]


def state() -> State:
    """Say which kernels this process has.

    Returns
    -------
    State
        ``enabled``: False when ``TRANSIENTCAM_KERNELS=off``. ``compiled``: names of the kernels in
        use, as in "levinson m=4 float32". ``compiling``: the one being compiled now, or None.
        ``failed``: those that could not be compiled, with the reason; NumPy stands in for them.
    """
    compiling = KERNELS.compiling
    return {
        "enabled": KERNELS.enabled,
        "compiled": [str(key) for key in list(KERNELS.compiled)],
        "compiling": None if compiling is None else str(compiling),
        "failed": [f"{key}: {reason}" for key, reason in list(KERNELS.failed.items())],
    }


def devices(check: int | None = None) -> list[_gpu.Adapter]:
    """Return what could compute frames here beside this processor, real GPUs first.

    Each has ``name``, ``kind``, ``backend``, ``driver``, and real GPUs why they are ``refused``,
    if they are: by a known frame of order ``check``, 1 to 8, which takes seconds.

    Raises
    ------
    DeviceUnavailable
        Where that cannot be found out: wgpu, of the extra ``gpu``, is not installed.
    ParameterError
        For another order.
    """
    if check is not None and not 1 <= check <= MOST_ROOTS:
        raise ParameterError("check", check, f"1 to {MOST_ROOTS}")
    with closing(_gpu.Device()) as any_device:
        found = any_device.adapters()
    for at, each in enumerate(found):
        if check is None or each.kind == _gpu.SOFTWARE:
            continue
        with closing(_gpu.Device(f"gpu:{each.name}")) as device:
            try:
                device.require(check)
            except DeviceUnavailable as error:
                found[at] = each._replace(refused=error.reason)
    return found


def use_device(name: str) -> None:
    """Have calls from now on use a device, and each `Reconstructor` unless it is given one.

    ``name``: as the Reconstructor takes it; "cpu" until this is called.

    Raises
    ------
    ParameterError
        For another name.
    DeviceUnavailable
        For "gpu" and "gpu:NAME", where there is no such adapter.
    """
    device = _gpu.device_of(name)
    if device is not None and name != "auto":
        device.require(0)
    _gpu.CHOICE[0] = name
    choice = _gpu.Choice(device, automatic=name == "auto")
    EVERYWHERE[0] = choice.kernel if device else None


def device_state() -> _gpu.DeviceState | None:
    """Return what `use_device` chose and how often its results were used; None for "cpu".

    ``wanted``, the adapter's ``name`` or None, ``results`` by "device" and "processor", of those
    that the device was asked for, and why it is ``refused``, or None.
    """
    device = _gpu.device_of(_gpu.CHOICE[0])
    return None if device is None else device.state()


def cache_directory() -> Path | None:
    """Return where kernels are kept between processes; None where nothing can be written to."""
    return CACHE.directory()


def ready(name: str, harmonics: int) -> bool:
    """Say whether a kernel for single precision serves calls from now on.

    One that does not is made ready in the background, unless another one just is; ask again.

    Parameters
    ----------
    name : str
        One of `LANES`.
    harmonics : int
        The order m, 1 to 32. Where there is no such kernel, it is never ready.

    Raises
    ------
    ParameterError
        For another order or kernel.
    """
    chosen("name", name, LANES)
    _require_order(harmonics)
    key = Key.of(name, harmonics, "f")
    if key in KERNELS.compiled:
        return True
    if KERNELS.compiling is None and key.is_offered:
        KERNELS.want(key)
    return False


def compile(  # noqa: A001  # tm.kernels.compile is the plain name, and the builtin isn't used here
    harmonics: Sequence[int] = (3, 4, 8),
    precisions: Sequence[str] = ("float32", "float64"),
    *,
    names: Sequence[str] = LANES,
    progress: Progress | None = None,
) -> None:
    """Compile all kernels, or load them from the cache, before returning.

    Parameters
    ----------
    harmonics : sequence of int
        Orders m, each 1 to 32, the most urgent first. Above 8 there are kernels for coefficients,
        densities and their peaks only.
    precisions : sequence of {"float32", "float64"}
        Most urgent first; all of one order before the next. Single precision uses the kernels for
        double where it isn't enough.
    names : sequence of str
        Which of `LANES`; all of them, when left out.
    progress : callable, optional
        Called as ``progress(done, total, name)`` before each kernel and after the last.

    Raises
    ------
    ParameterError
        For another order, precision or kernel.

    Notes
    -----
    A kernel that fails to compile is noted in `state`; the others are compiled all the same. Does
    nothing when kernels are off. Safe to call from several threads: each kernel is compiled once.
    """
    for name in names:
        chosen("names", name, LANES)
    keys = [key for key in _keys(harmonics, precisions) if key.name in names]
    if not KERNELS.enabled:
        return
    report = progress or (lambda done, total, name: None)
    for done, key in enumerate(keys):
        report(done, len(keys), str(key))
        KERNELS.make_ready(key)
    report(len(keys), len(keys), "")


def load(names: Sequence[str], harmonics: int) -> None:
    """Load kernels that are in the cache, before returning; none is compiled. As of `settled`."""
    for key in _named(names, harmonics) if KERNELS.automatic else ():
        KERNELS.make_kept_ready(key)


def prepare(names: Sequence[str], harmonics: int) -> threading.Thread | None:
    """Make kernels ready in the background, in this order and before all others; as of `settled`.

    What calls wanted before is dropped until they want it again. Returns the thread, named
    "transientcam-compile", which ends when nothing is left to do; None where
    ``TRANSIENTCAM_KERNELS`` is "off" or "manual".
    """
    return KERNELS.prefer(_named(names, harmonics))


def preparing(names: Sequence[str], harmonics: int, now_s: float) -> tuple[list[str], float]:
    """Return which of these kernels are being made ready, the next one first; as of `settled`.

    And about how long it takes on an idle processor until the last of them is, in s. ``now_s`` is
    by any clock, the same one at each call: what is compiled began when it was first asked about.
    """
    found, left_s = KERNELS.left(_named(names, harmonics), now_s)
    return [str(key) for key in found], left_s


@contextmanager
def only_note() -> Iterator[None]:
    """Only note, inside the block, what calls would have made ready in the background.

    For a process that has to answer in seconds: importing what loads kernels takes half of one.
    `make_ready` begins with what was noted. Nothing is noted where ``TRANSIENTCAM_KERNELS`` is
    "off" or "manual".
    """
    before, KERNELS.noting = KERNELS.noting, True
    try:
        yield
    finally:
        KERNELS.noting = before


def make_ready() -> None:
    """Load or compile in the background what calls since `only_note` would have used."""
    KERNELS.make_wanted_ready()


def settled(names: Sequence[str], harmonics: int) -> bool:
    """Say whether calls in single precision use all kernels already that they get by themselves.

    Parameters
    ----------
    names : sequence of str
        Which of `LANES`; those that are not offered for this order do not count.
    harmonics : int
        The order m, 1 to 32.

    Raises
    ------
    ParameterError
        For another order or kernel.
    """
    keys = _named(names, harmonics)
    return not KERNELS.automatic or all(
        lookup(key.name, key.harmonics, LEAST_PIXELS) or key in KERNELS.failed for key in keys
    )


def _named(names: Sequence[str], harmonics: int) -> list[Key]:
    """Return the keys of kernels for single precision, in the order of the names."""
    for name in names:
        chosen("names", name, LANES)
    _require_order(harmonics)
    return [key for name in names if (key := Key.of(name, harmonics, "f")).is_offered]


def _require_order(harmonics: int) -> None:
    if not 1 <= harmonics <= MAX_HARMONICS:
        raise ParameterError("harmonics", harmonics, f"1 to {MAX_HARMONICS}")


def _keys(harmonics: Sequence[int], precisions: Sequence[str]) -> list[Key]:
    for m in harmonics:
        _require_order(m)
    for precision in precisions:
        if precision not in PRECISION_NAMES:
            raise ParameterError("precisions", precision, "float32 or float64")
    keys = (
        Key.of(name, m, PRECISION_NAMES[precision])
        for m in dict.fromkeys(harmonics)
        for precision in precisions
        for name in LANES
    )
    return [key for key in dict.fromkeys(keys) if key.is_offered]


def _load(key: Key) -> Kernel:
    from transientcam_moments._kernels.compiler import compile_kernel  # numba, where it compiles

    return compile_kernel(key)


KERNELS.load = _load
