"""Lanes that a call does not find: made ready on a background thread, which no call waits for."""

import logging
import threading
from typing import Any, Final

from numpy.typing import NDArray

from transientcam_moments._lanes.helper import Helper, program
from transientcam_moments._lanes.parallel import start_threads
from transientcam_moments._lanes.pool import POOL
from transientcam_moments._lanes.registry import REGISTRY, Key

THREAD: Final = "transientcam-compile"
"""Name of every thread that compiles."""
MOST_ROOTS: Final = 8
"""The largest m with lanes for eigenvalues and returns."""
LATEST_S: Final = 0.3
"""How long loading waits for the call that wants a lane, which may take longer than loading."""
_SINGLE_ONLY: Final = (
    "smooth",
    "measure",
    "separate",
    "reconstruct",
    "likelihood",
    "pairs",
    "harmonics",
)
_DOUBLE_ONLY: Final = ("covariance", "direct_noise")
_FEW_ROOTS: Final = (
    "pisarenko",
    "smallest_eigenvalue",
    "reconstruct",
    "likelihood",
    "covariance",
    "direct_noise",
)
_log = logging.getLogger("transientcam_moments")


class _Wanted:
    """What is wanted, in the order of the calls; once each."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.seen: set[Key] = set()
        self.waiting: list[Key] = []
        self.results_bytes: dict[Key, list[int]] = {}
        self.may_load = threading.Event()
        self.thread: threading.Thread | None = None
        self.said = False


_WANTED = _Wanted()


def want(key: Key, *, computing: bool = False) -> None:
    """Have a lane made ready in the background; returns at once, also where it cannot be.

    Parameters
    ----------
    computing
        NumPy computes the same on this thread now, and `returned` is called after it. Loading
        begins then, or after `LATEST_S`: it would take the interpreter's lock from the call again
        and again, and make it several times as long.
    """
    if not REGISTRY.automatic or key in _WANTED.seen:
        return
    with _WANTED.lock:
        if key in _WANTED.seen:
            return
        if computing:
            _WANTED.may_load.clear()
        else:
            _WANTED.may_load.set()
        _WANTED.seen.add(key)
        if not is_offered(key):
            return
        _WANTED.waiting.append(key)
        if not REGISTRY.noting:
            _start_to_work()


def work_on_wanted() -> None:
    """Make ready in the background what calls wanted so far; returns at once."""
    with _WANTED.lock:
        if _WANTED.waiting:
            _WANTED.may_load.set()
            _start_to_work()


def _start_to_work() -> None:
    """Start the thread, unless it works; under the lock."""
    if not _WANTED.said:
        _WANTED.said = True
        _log.info(
            "kernels are loaded from the cache, or compiled in the background; until then "
            "NumPy computes the same (TRANSIENTCAM_KERNELS=off leaves everything to it)"
        )
    if _WANTED.thread is None:
        # not a daemon: those are frozen at exit wherever they are, which a compiler doesn't survive
        _WANTED.thread = threading.Thread(target=_work, name=THREAD)
        _WANTED.thread.start()


def returned(key: Key, results: NDArray[Any] | tuple[NDArray[Any], ...]) -> None:
    """Note what NumPy returned in the place of a lane that is being made ready.

    The lane finds memory for as much: the next call is likely the same, and the system takes three
    times as long to clear new memory for the density of a film as the lane takes to compute it.
    """
    _WANTED.may_load.set()
    if _WANTED.thread is not None and key in _WANTED.seen:
        arrays = results if isinstance(results, tuple) else (results,)
        _WANTED.results_bytes[key] = [each.nbytes for each in arrays]


def is_offered(key: Key) -> bool:
    """Say whether there is such a lane; the planar statement does all orders."""
    if key.name in _SINGLE_ONLY and key.precision != "f":
        return False
    if key.name in _DOUBLE_ONLY and key.precision != "d":
        return False
    if key.name == "pairs" and key.harmonics < 2:
        return False
    # a characteristic polynomial with more roots underflows where they cluster
    return key.harmonics <= MOST_ROOTS or key.name not in _FEW_ROOTS


def _is_long(key: Key) -> bool:
    """Say whether a lane takes many times as long to compile as the others."""
    return key.name in ("reconstruct", "likelihood")


def _work() -> None:
    """Compile what is wanted until nothing is, or the process ends."""
    main = threading.main_thread()
    start_threads()
    with Helper(program()) as helper:
        while True:
            _WANTED.may_load.wait(LATEST_S)
            with _WANTED.lock:
                if not _WANTED.waiting or not main.is_alive():
                    _WANTED.thread = None
                    return
                _WANTED.waiting.sort(key=_is_long)  # stable: what is ready soon goes first
                key = _WANTED.waiting.pop(0)
            compile_one(key, helper)


def compile_one(key: Key, helper: Helper | None = None) -> None:
    """Load a lane from the cache or compile it, unless that was done or failed before.

    It is compiled by ``helper``, where that is given, and by this thread else.
    """
    with REGISTRY.lock:
        if key in REGISTRY.compiled or key in REGISTRY.failed:
            return
        REGISTRY.compiling = key
        try:
            lane = REGISTRY.make(key, helper)
            if lane is not None:
                POOL.prepare(_WANTED.results_bytes.pop(key, ()))
                REGISTRY.compiled[key] = lane
        except Exception as error:
            # whatever stops a compiler (a missing one, a full disk, an unknown processor) must
            # stop nothing else: the planar statement goes on serving
            REGISTRY.failed[key] = f"{type(error).__name__}: {error}".splitlines()[0]
        finally:
            REGISTRY.compiling = None
