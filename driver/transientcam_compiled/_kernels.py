"""Kernels that a call does not find: made ready in the background, which no call waits for."""

import bisect
import gc
import logging
import threading
from collections.abc import Callable, Container, Hashable, Iterable, Mapping
from contextlib import suppress
from typing import Any, Final, Generic, TypeVar

from numpy.typing import NDArray

from transientcam_compiled._cache import Cache, NotKept, only_from_cache
from transientcam_compiled._memory import POOL
from transientcam_compiled._process import ChildProcess, Tell, python
from transientcam_compiled._spread import start_threads

THREAD: Final = "transientcam-compile"
"""Name of every thread that compiles."""
LATEST_S: Final = 0.3
"""How long loading waits for the call that wants a kernel, which may take longer than loading."""
Key = TypeVar("Key", bound=Hashable)
_log = logging.getLogger("transientcam_compiled")


class _ProgramEnds(Exception):  # noqa: N818 - no error
    """The main thread has ended."""


class Kernels(Generic[Key]):
    """The kernels of one library in this process, and how far making them ready has come.

    A kernel does the same as a function in NumPy, which serves until the kernel is ready: loaded
    from the cache. What is not kept there is compiled into it first, by another process of low
    priority, or by the thread that loads where there can be none.

    ``TRANSIENTCAM_KERNELS``: "off" (or 0, no, false) leaves everything to NumPy; with "manual"
    there is nothing but what the process itself compiles.

    ``environ`` (mapping): of the process.
    ``cache`` (Cache): in which the code is kept.
    ``load`` (callable, optional): returns a kernel, which `Cache.compile` has loaded or compiled; a
    function of a module. Left out where it is set later, from above: kernels may be compiled of
    functions of modules that look them up.
    ``added`` (callable, optional): called with each kernel that has become ready, and its key
    before it.
    ``expected_s`` (callable, optional): about how long it takes to compile a kernel on an idle
    processor; what takes less goes first.
    ``enabled``, ``automatic`` (bool): whether there are kernels at all, and whether calls have them
    made ready.
    ``noting`` (bool): what calls want is made ready only when that is asked for.
    ``compiled`` (dict): what is ready: read by every call, without a lock.
    ``compiling``: what is made ready now, or None.
    ``failed`` (dict): reasons, in one line each. What has failed is not tried again.
    """

    def __init__(
        self,
        environ: Mapping[str, str],
        cache: Cache,
        load: Callable[[Key], Any] | None = None,
        *,
        added: Callable[[Key, Any], object] = lambda key, kernel: None,
        expected_s: Callable[[Key], float] = lambda key: 1.0,
    ) -> None:
        setting = environ.get("TRANSIENTCAM_KERNELS", "on").strip().lower()
        self.enabled = setting not in ("off", "0", "no", "false")
        self.automatic = self.enabled and setting != "manual"
        self.noting = False
        self.compiled: dict[Key, Any] = {}
        self.compiling: Key | None = None
        self.failed: dict[Key, str] = {}
        if load is not None:
            self.load = load
        self._cache = cache
        self._added = added
        self._expected_s = expected_s
        self._watched: tuple[Key | None, float] = (None, 0.0)
        self._making = threading.Lock()
        self._queueing = threading.Lock()
        self._seen: set[Key] = set()
        self._urgent: list[Key] = []
        self._waiting: list[Key] = []
        self._results_bytes: dict[Key, list[int]] = {}
        self._may_load = threading.Event()
        self._thread: threading.Thread | None = None
        self._child: ChildProcess | None = None
        self._said = False

    # -- in the background -------------------------------------------------------------------------

    def want(self, key: Key, *, computing: bool = False) -> None:
        """Have a kernel made ready in the background; returns at once, also where it cannot be.

        ``computing``: NumPy computes the same on this thread now, and `returned` is called after
        it. Loading begins then, or after `LATEST_S`: it would take the interpreter's lock from the
        call again and again, and make it several times as long.
        """
        if not self.automatic or key in self._seen:
            return
        with self._queueing:
            if key in self._seen:
                return
            if computing:
                self._may_load.clear()
            else:
                self._may_load.set()
            self._seen.add(key)
            # what is ready soon goes before what takes long
            bisect.insort(self._waiting, key, key=self._expected_s)
            if self.noting:
                return
            if not self._said:
                self._said = True
                _log.info(
                    "kernels are loaded from the cache, or compiled in the background; until then "
                    "NumPy computes the same (TRANSIENTCAM_KERNELS=off leaves everything to it)"
                )
            self._work()

    def returned(self, key: Key, results: NDArray[Any] | tuple[NDArray[Any], ...]) -> None:
        """Note what NumPy returned in the place of a kernel that is being made ready.

        The kernel finds memory for as much: the next call is likely the same, and the system takes
        three times as long to clear new memory for the density of a film as the kernel takes to
        compute it.
        """
        self._may_load.set()
        if self._thread is not None and key in self._seen:
            arrays = results if isinstance(results, tuple) else (results,)
            self._results_bytes[key] = [each.nbytes for each in arrays]

    def make_wanted_ready(self) -> None:
        """Make ready in the background what calls wanted so far; returns at once."""
        with self._queueing:
            if self._waiting:
                self._may_load.set()
                self._work()

    def prefer(self, keys: Iterable[Key]) -> threading.Thread | None:
        """Make these ready in the background, in this order, and before all others.

        What calls wanted so far, and what they want until then, is dropped: with these kernels they
        may do without, and else they want it again. Returns the thread, or None where calls have
        nothing made ready.
        """
        if not self.automatic:
            return None
        with self._queueing:
            self._may_load.set()
            self._drop(self._urgent)
            self._drop(self._waiting)
            known = (*self.compiled, *self.failed, self.compiling)
            self._urgent += [key for key in keys if key not in known]
            self._seen.update(self._urgent)
            return self._work()

    def left(self, keys: Container[Key], now_s: float) -> tuple[list[Key], float]:
        """Return which of these wait or are made ready now, and about how long that takes in s.

        What is made ready has begun when it was first looked at, by the caller's clock.
        """
        with self._queueing:
            now, queue = self.compiling, [*self._urgent, *self._waiting]
            if now != self._watched[0]:
                self._watched = now, now_s
            begun_s = self._watched[1]
        taking_s = [self._expected_s(key) for key in queue]
        if now is not None:
            queue.insert(0, now)
            taking_s.insert(0, max(1.0, self._expected_s(now) - (now_s - begun_s)))
        found = [k for k, key in enumerate(queue) if key in keys]
        return [queue[k] for k in found], sum(taking_s[: found[-1] + 1]) if found else 0.0

    def _drop(self, keys: list[Key]) -> None:
        self._seen.difference_update(keys)
        keys.clear()

    def _work(self) -> threading.Thread:
        """Start the thread, unless it works; under the lock of the queue."""
        if self._thread is None:
            # not a daemon: those are frozen at exit wherever they are, which a compiler doesn't
            # survive
            self._thread = threading.Thread(target=self._make_waiting_ready, name=THREAD)
            self._thread.start()
        return self._thread

    def _make_waiting_ready(self) -> None:
        """Make ready what waits until nothing does, or the program ends."""
        main = threading.main_thread()
        start_threads()
        self._child = child = ChildProcess() if python() else None
        try:
            while True:
                self._may_load.wait(LATEST_S)
                with self._queueing:
                    queue = self._urgent or self._waiting
                    if not (queue and self.enabled and main.is_alive()):
                        self._thread = None
                        return
                    urgent, key = queue is self._urgent, queue.pop(0)
                    self.compiling = key
                self.make_ready(key, elsewhere=True)
                with self._queueing:
                    if urgent and not self._urgent:
                        self._drop(self._waiting)
        finally:
            if child is not None:
                child.end()

    # -- one by one --------------------------------------------------------------------------------

    def make_ready(self, key: Key, *, elsewhere: bool = False) -> None:
        """Load a kernel from the cache or compile it, unless that was done or has failed before.

        It is compiled by another process where it is wanted ``elsewhere`` and there can be one.
        """
        if not self.enabled:
            return
        with self._making:
            if key in self.compiled or key in self.failed:
                self.compiling = None
                return
            self.compiling = key
            try:
                kernel = self._made_elsewhere(key) if elsewhere else self.load(key)
                POOL.prepare(self._results_bytes.pop(key, ()))
                self.compiled[key] = kernel
                self._added(key, kernel)
            except _ProgramEnds:
                pass
            except Exception as error:
                # whatever stops a compiler (a missing one, a full disk, an unknown processor) must
                # stop nothing else: NumPy goes on serving
                self.failed[key] = f"{type(error).__name__}: {error}".splitlines()[0]
                _log.info("NumPy goes on without the kernel %s: %s", key, self.failed[key])
            finally:
                self.compiling = None

    def make_kept_ready(self, key: Key) -> None:
        """Load a kernel, unless the cache does not have it; nothing is compiled."""
        if self.enabled:
            with suppress(NotKept), self._making, only_from_cache():
                if key not in self.compiled and key not in self.failed:
                    self.compiled[key] = kernel = self.load(key)
                    self._added(key, kernel)

    def _made_elsewhere(self, key: Key) -> Any:
        if self._child is not None and self._cache.directory() is not None:
            with suppress(NotKept), only_from_cache():
                return self.load(key)
            try:
                self._child.call(_fill_cache, self.load, key, ask=_go_on)
            except _ProgramEnds:
                raise
            except Exception as error:
                _log.warning(
                    "the process that compiles kernels has failed (%s); they are compiled on a "
                    "thread",
                    error,
                )
                self._child = None
        return self.load(key)


def _fill_cache(load: Callable[[Key], Any], key: Key, _tell: Tell) -> None:
    """Compile a kernel into the cache, in the other process."""
    # millions of objects, of which hardly any is garbage before the end
    gc.disable()
    with suppress(Exception):  # the one that wants it finds the same by itself
        load(key)
    gc.collect()


def _go_on() -> None:
    if not threading.main_thread().is_alive():
        raise _ProgramEnds
