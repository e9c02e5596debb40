"""Compiled lanes for the hot algorithms: what is ready, and how to make it ready.

Nothing has to be called. Every algorithm runs on NumPy and gives the same results; from the first
call with 4096 pixels or more on, the lane that would have served it is loaded from the cache (half
a second) on a thread that no call waits for, and later calls change over to it. What is not in the
cache is compiled into it first (seconds, once on a machine), by a process of low priority, or by
that thread where there can be none. `compile` makes lanes ready beforehand, and waits for them.

A process that ends meanwhile waits for no lane, or at most for the one that is being compiled by
its thread. The environment variable ``TRANSIENTCAM_KERNELS=off`` leaves everything to NumPy,
``TRANSIENTCAM_KERNELS=manual`` compiles only what `compile` and `compile_in_background` are called
for. Compiled code is kept for the next process in ``NUMBA_CACHE_DIR``, else in
``transientcam/kernels`` below ``XDG_CACHE_HOME`` or ``~/.cache``, else (nothing there can be
written to) not at all.

`density`, `levinson`, `pisarenko` and `reconstruct` use all cores, or as many threads as their
``threads`` says. A program that makes such calls on threads of its own calls `use_one_thread` on
each of these, and `use_all_cores` for what is urgent.
"""

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypedDict

from transientcam_moments._lanes import lookup
from transientcam_moments._lanes.automatic import (
    MOST_ROOTS,
    THREAD,
    compile_one,
    is_offered,
    want,
    work_on_wanted,
)
from transientcam_moments._lanes.helper import Helper, program
from transientcam_moments._lanes.parallel import (
    Spread,
    at_once,
    over,
    over_all_cores,
    use_all_cores,
    use_one_thread,
)
from transientcam_moments._lanes.registry import (
    LEAST_PIXELS,
    PRECISION_NAMES,
    REGISTRY,
    Key,
    Lane,
)
from transientcam_moments.arrays import MAX_HARMONICS, chosen
from transientcam_moments.errors import ParameterError

__all__ = [
    "LANES",
    "MOST_ROOTS",
    "THREAD",
    "WHEN_NEEDED",
    "Progress",
    "Spread",
    "State",
    "at_once",
    "compile",
    "compile_in_background",
    "make_ready",
    "only_note",
    "over",
    "over_all_cores",
    "ready",
    "settled",
    "state",
    "use_all_cores",
    "use_one_thread",
]

LANES = (
    "pisarenko",
    "smallest_eigenvalue",
    "smooth",
    "measure",
    "separate",
    "levinson",
    "density",
    "peaks",
    "reconstruct",
    "likelihood",
    "pairs",
    "harmonics",
    "covariance",
    "direct_noise",
)
WHEN_NEEDED = ("likelihood", "pairs", "harmonics", "peaks")
"""Those that `compile_in_background` leaves out, but for one of them of its first order."""
Progress = Callable[[int, int, str], None]
"""Takes lanes done, lanes in all, and the name of the lane that is next ("" after the last)."""


class State(TypedDict):
    """What `state` returns."""

    enabled: bool
    compiled: list[str]
    compiling: str | None
    failed: list[str]


def state() -> State:
    """Say which lanes this process has.

    Returns
    -------
    State
        ``enabled``: False when ``TRANSIENTCAM_KERNELS=off``. ``compiled``: names of the lanes in
        use, as in "levinson m=4 float32". ``compiling``: the one being compiled now, or None.
        ``failed``: those that could not be compiled, with the reason; NumPy stands in for them.
    """
    compiling = REGISTRY.compiling
    return {
        "enabled": REGISTRY.enabled,
        "compiled": [str(key) for key in list(REGISTRY.compiled)],
        "compiling": None if compiling is None else str(compiling),
        "failed": [f"{key}: {reason}" for key, reason in list(REGISTRY.failed.items())],
    }


def ready(name: str, harmonics: int) -> bool:
    """Say whether a lane for single precision serves calls from now on.

    One that does not is made ready in the background, unless another one just is; ask again.

    Parameters
    ----------
    name : str
        One of `LANES`.
    harmonics : int
        The order m, 1 to 32. Where there is no such lane, it is never ready.

    Raises
    ------
    ParameterError
        For another order or lane.
    """
    chosen("name", name, LANES)
    _require_order(harmonics)
    key = Key(name, harmonics, "f")
    if key in REGISTRY.compiled:
        return True
    if REGISTRY.compiling is None:
        want(key)
    return False


def compile(  # noqa: A001  # tm.kernels.compile is the plain name, and the builtin isn't used here
    harmonics: Sequence[int] = (3, 4, 8),
    precisions: Sequence[str] = ("float32", "float64"),
    *,
    names: Sequence[str] = LANES,
    progress: Progress | None = None,
) -> None:
    """Compile all lanes, or load them from the cache, before returning.

    Parameters
    ----------
    harmonics : sequence of int
        Orders m, each 1 to 32, the most urgent first. Above 8 there are lanes for coefficients,
        densities and their peaks only.
    precisions : sequence of {"float32", "float64"}
        Most urgent first; all of one order before the next. Single precision uses the lanes for
        double where it isn't enough.
    names : sequence of str
        Which of `LANES`; all of them, when left out.
    progress : callable, optional
        Called as ``progress(done, total, name)`` before each lane and after the last.

    Raises
    ------
    ParameterError
        For another order, precision or lane.

    Notes
    -----
    A lane that fails to compile is noted in `state`; the others are compiled all the same. Does
    nothing when kernels are off. Safe to call from several threads: each lane is compiled once.
    """
    for name in names:
        chosen("names", name, LANES)
    keys = [key for key in _keys(harmonics, precisions) if key.name in names]
    _compile(keys, progress, lambda: True)


def compile_in_background(
    harmonics: Sequence[int] = (3, 4, 8),
    precisions: Sequence[str] = ("float32", "float64"),
    *,
    also: str = "likelihood",
) -> threading.Thread:
    """Start compiling on a thread and return it; arguments and errors as in `compile`.

    Leaves out "harmonics", "pairs" and "peaks", which few cameras need, and "likelihood", which
    takes long to compile: they are prepared by themselves when they are first needed. ``also``
    names one of them that is compiled for the first order all the same; "pairs" before all others,
    since a camera whose frequencies have gaps needs little else.

    The thread is named "transientcam-compile", and can be joined.
    """
    chosen("also", also, WHEN_NEEDED)
    keys = [
        key
        for key in _keys(harmonics, precisions)
        if key.name not in WHEN_NEEDED or (key.name == also and key.harmonics == harmonics[0])
    ]
    keys.sort(key=lambda key: key.name != "pairs")
    main = threading.main_thread()

    def work() -> None:
        with Helper(program()) as helper:
            _compile(keys, None, main.is_alive, helper)

    # not a daemon: those are frozen at exit wherever they are, which a compiler doesn't survive
    thread = threading.Thread(target=work, name=THREAD)
    thread.start()
    return thread


@contextmanager
def only_note() -> Iterator[None]:
    """Only note, inside the block, what calls would have made ready in the background.

    For a process that has to answer in seconds: importing what loads lanes takes half of one.
    `make_ready` begins with what was noted. Nothing is noted where ``TRANSIENTCAM_KERNELS`` is
    "off" or "manual".
    """
    before, REGISTRY.noting = REGISTRY.noting, True
    try:
        yield
    finally:
        REGISTRY.noting = before


def make_ready() -> None:
    """Load or compile in the background what calls since `only_note` would have used."""
    work_on_wanted()


def settled(names: Sequence[str], harmonics: int) -> bool:
    """Say whether calls in single precision already use all lanes that they will get by themselves.

    Parameters
    ----------
    names : sequence of str
        Which of `LANES`; those that are not offered for this order do not count.
    harmonics : int
        The order m, 1 to 32.

    Raises
    ------
    ParameterError
        For another order or lane.
    """
    for name in names:
        chosen("names", name, LANES)
    keys = [key for key in _keys([harmonics], ["float32"]) if key.name in names]
    return not REGISTRY.automatic or all(
        lookup(key.name, key.harmonics, LEAST_PIXELS) or key in REGISTRY.failed for key in keys
    )


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
        Key(name, m, PRECISION_NAMES[precision])
        for m in dict.fromkeys(harmonics)
        for precision in precisions
        for name in LANES
    )
    return [key for key in keys if is_offered(key)]


def _compile(
    keys: list[Key],
    progress: Progress | None,
    go_on: Callable[[], bool],
    helper: Helper | None = None,
) -> None:
    if not REGISTRY.enabled:
        return
    for done, key in enumerate(keys):
        if not go_on():
            return
        if progress is not None:
            progress(done, len(keys), str(key))
        compile_one(key, helper)
    if progress is not None:
        progress(len(keys), len(keys), "")


def _make(key: Key, helper: Helper | None) -> Lane | None:
    """Return a lane from the cache, else compiled; None where the program ends meanwhile."""
    from transientcam_moments._kernels import compiler  # numba, on the thread that compiles

    if helper is not None and compiler.is_kept():
        lane = compiler.load_lane(key)
        if lane is not None:
            return lane
        if not helper.compile(*key):
            return None
    return compiler.compile_lane(key)


REGISTRY.make = _make
