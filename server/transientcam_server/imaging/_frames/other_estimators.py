"""Estimators of other packages, each in a process of its own: whatever it does, frames go on."""

import logging
import math
import threading
import time
from collections.abc import Callable
from typing import Any

import transientcam_moments as tm
from transientcam_compiled import ChildProcess, ProcessEnded
from transientcam_moments import comparisons

_log = logging.getLogger("transientcam_server.imaging.other_estimators")
START_S = 60.0
"""For a process to start and to import what the estimator needs."""
_REST = 10
"""Times as long as an estimator kept a worker in vain nobody asks it again."""


class OtherEstimators:
    """Computes what estimators of other packages find, of one frame at a time each.

    One that does not answer in ``limit_s``, or whose process ends, is not asked for `_REST` times
    as long as that took. Call it from any thread, as `comparisons.SEPARATORS` are.
    ``clock``: time in s.
    """

    def __init__(self, limit_s: float, *, clock: Callable[[], float] = time.monotonic) -> None:
        self._limit_s, self._clock = limit_s, clock
        self._processes: dict[str, _Process] = {}
        self._closing = threading.Event()

    def open(self) -> None:
        """Separate for all reconstructions of this program; import what there is to say of each."""
        for found in comparisons.statements().values():
            if isinstance(found, tm.EstimatorFailed):
                _log.warning("%s", found)
            else:
                self._processes[found.name] = _Process()
        comparisons.SEPARATORS.append(self)

    def __call__(self, name: str, *arguments: Any) -> tm.Separation:
        """Return direct and indirect light and phase.

        Raises EstimatorFailed: what the estimator did instead.
        """
        process = self._processes[name]
        with process.calling:
            rest_s = process.rests_until_s - self._clock()
            if rest_s > 0:
                reason = f"{process.reason}; it is asked again in {rest_s:.0f} s"
                raise tm.EstimatorFailed(name, reason)
            began_s = self._clock()
            try:
                if not process.warm:
                    self._call(process, name, START_S, comparisons.import_there)
                    process.warm = True
                there = comparisons.separated_there
                found: tm.Separation = self._call(process, name, self._limit_s, there, *arguments)
            except (TimeoutError, ProcessEnded) as error:
                process.warm = False
                ended = isinstance(error, ProcessEnded)
                process.reason = "its process has ended" if ended else str(error)
                process.rests_until_s = self._clock() + _REST * (self._clock() - began_s)
                raise tm.EstimatorFailed(name, process.reason) from None
            except OSError as error:
                raise tm.EstimatorFailed(name, f"it has no process: {error}") from error
            return found

    def _call(
        self,
        process: "_Process",
        name: str,
        limit_s: float,
        function: Callable[..., Any],
        *arguments: Any,
    ) -> Any:
        ends_s = self._clock() + limit_s

        def ask() -> None:
            if self._closing.is_set():
                raise tm.EstimatorFailed(name, "the service is shutting down")
            if self._clock() > ends_s:
                raise TimeoutError(f"it took longer than {limit_s:g} s")

        return process.child.call(function, name, *arguments, ask=ask)

    def close(self) -> None:
        """End every process, and what is computed there."""
        self._closing.set()
        if self in comparisons.SEPARATORS:
            comparisons.SEPARATORS.remove(self)
        for process in self._processes.values():
            with process.calling:
                process.child.end()


class _Process:
    """The process of one estimator, and what is known of it."""

    def __init__(self) -> None:
        self.child = ChildProcess(tm.kernels.only_note)
        self.calling = threading.Lock()
        self.warm, self.rests_until_s, self.reason = False, -math.inf, ""
