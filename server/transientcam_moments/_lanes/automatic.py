"""Lanes that a call does not find: made ready on a background thread, which no call waits for."""

import logging
import threading
from typing import Final

from transientcam_moments._lanes.helper import Helper, program
from transientcam_moments._lanes.parallel import start_threads
from transientcam_moments._lanes.registry import REGISTRY, Key

THREAD: Final = "transientcam-compile"
"""Name of every thread that compiles."""
MOST_ROOTS: Final = 8
"""The largest m with lanes for eigenvalues and returns."""
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
        self.thread: threading.Thread | None = None
        self.said = False


_WANTED = _Wanted()


def want(key: Key) -> None:
    """Have a lane made ready in the background; returns at once, also where it cannot be."""
    if not REGISTRY.automatic or key in _WANTED.seen:
        return
    with _WANTED.lock:
        if key in _WANTED.seen:
            return
        _WANTED.seen.add(key)
        if not is_offered(key):
            return
        if not _WANTED.said:
            _WANTED.said = True
            _log.info(
                "kernels are loaded from the cache, or compiled in the background; until then "
                "NumPy computes the same (TRANSIENTCAM_KERNELS=off leaves everything to it)"
            )
        _WANTED.waiting.append(key)
        if _WANTED.thread is None:
            # not a daemon: those are frozen at exit wherever they are, which a compiler
            # doesn't survive
            _WANTED.thread = threading.Thread(target=_work, name=THREAD)
            _WANTED.thread.start()


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
    return key.name == "reconstruct"


def _work() -> None:
    """Compile what is wanted until nothing is, or the process ends."""
    main = threading.main_thread()
    start_threads()
    with Helper(program()) as helper:
        while True:
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
                REGISTRY.compiled[key] = lane
        except Exception as error:
            # whatever stops a compiler (a missing one, a full disk, an unknown processor) must
            # stop nothing else: the planar statement goes on serving
            REGISTRY.failed[key] = f"{type(error).__name__}: {error}".splitlines()[0]
        finally:
            REGISTRY.compiling = None
