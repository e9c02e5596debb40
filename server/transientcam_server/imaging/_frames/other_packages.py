"""Code of other packages, each in a process of its own: whatever it does, frames go on."""

import logging
import math
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import transientcam_moments as tm
from transientcam_compiled import ChildProcess, ProcessEnded
from transientcam_moments import plugins

_log = logging.getLogger("transientcam_server.imaging.other_packages")
START_S = 60.0
"""For a process to start and to import what the code needs."""
_REST = 10
"""Times as long as it kept a worker in vain nobody asks it again."""


class OtherPackages:
    """Calls estimators and products of other packages, each for one frame at a time.

    One that does not answer in ``limit_s``, or whose process ends, is not asked for `_REST` times
    as long as that took. Call it from any thread, as `plugins.CALLERS` are. ``clock``: time in s.
    """

    def __init__(self, limit_s: float, *, clock: Callable[[], float] = time.monotonic) -> None:
        self._limit_s, self._clock = limit_s, clock
        self._processes: dict[tuple[str, str], _Process] = {}
        self._closing = threading.Event()

    def open(self) -> None:
        """Call for all reconstructions of this program; import what there is to say of each."""
        for offered in plugins.GROUPS.values():
            for found in offered.statements().values():
                if isinstance(found, tm.PluginFailed):
                    _log.warning("%s", found)
        plugins.CALLERS.append(self)

    def __call__(self, group: str, function: Callable[..., Any], name: str, *arguments: Any) -> Any:
        """Return ``function(name, *arguments)``, which calls the code of a package.

        Raises PluginFailed: what that did instead.
        """
        process = self._processes.setdefault((group, name), _Process())
        failed = partial(tm.PluginFailed, plugins.GROUPS[group].kind, name)
        with process.calling:
            rest_s = process.rests_until_s - self._clock()
            if rest_s > 0:
                raise failed(f"{process.reason}; it is asked again in {rest_s:.0f} s")
            began_s = self._clock()
            try:
                if not process.warm:
                    self._call(process, failed, START_S, plugins.import_there, group, name)
                    process.warm = True
                return self._call(process, failed, self._limit_s, function, name, *arguments)
            except (TimeoutError, ProcessEnded) as error:
                process.warm = False
                ended = isinstance(error, ProcessEnded)
                process.reason = "its process has ended" if ended else str(error)
                process.rests_until_s = self._clock() + _REST * (self._clock() - began_s)
                raise failed(process.reason) from None
            except OSError as error:
                raise failed(f"it has no process: {error}") from error

    def _call(
        self,
        process: "_Process",
        failed: Callable[[str], tm.PluginFailed],
        limit_s: float,
        function: Callable[..., Any],
        *arguments: Any,
    ) -> Any:
        ends_s = self._clock() + limit_s

        def ask() -> None:
            if self._closing.is_set():
                raise failed("the service is shutting down")
            if self._clock() > ends_s:
                raise TimeoutError(f"it took longer than {limit_s:g} s")

        return process.child.call(plugins.call_there, function, *arguments, ask=ask)

    def close(self) -> None:
        """End every process, and what is computed there."""
        self._closing.set()
        if self in plugins.CALLERS:
            plugins.CALLERS.remove(self)
        for process in list(self._processes.values()):
            with process.calling:
                process.child.end()


class _Process:
    """The process of one, and what is known of it."""

    def __init__(self) -> None:
        self.child = ChildProcess(tm.kernels.only_note)
        self.calling = threading.Lock()
        self.warm, self.rests_until_s, self.reason = False, -math.inf, ""
