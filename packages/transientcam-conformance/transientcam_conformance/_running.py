"""All checks, and the running of them against one camera."""

import inspect
import time
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any, Final, Literal

from transientcam.errors import CheckSkipped, ParameterError, TransientcamError
from transientcam_conformance import (
    _authentication as authentication,
    _leasing as leasing,
    _parameters as parameters,
    _problems as problems,
    _recording as recording,
    _resuming as resuming,
    _routes as routes,
    _sizes as sizes,
    _slow_readers as slow_readers,
    _streaming as streaming,
    _tags as tags,
    _unplugging as unplugging,
)
from transientcam_conformance._device import API, Device


@dataclass(frozen=True, slots=True)
class Check:
    """One promise and the function that tries it."""

    group: str
    name: str
    """``group``, ``name``: its name in reports and on the command line."""
    promise: str
    """The sentence of the contract."""
    run: Callable[[Device], None]
    """Returns if the promise is kept; else raises `PromiseBroken`, or `CheckSkipped` if it cannot
    be tried."""


def checks(group: str, module: ModuleType) -> tuple[Check, ...]:
    """Return the public functions of a module as checks, in the order in which they stand.

    The name of one is its name, its docstring the promise.
    """
    return tuple(
        Check(group, name.replace("_", "-"), _sentence(each), each)
        for name, each in vars(module).items()
        if inspect.isfunction(each) and each.__module__ == module.__name__ and name[0] != "_"
    )


def _sentence(function: Callable[..., Any]) -> str:
    return " ".join((inspect.getdoc(function) or "").split())


_FRAMES: Final = 10
KEPT_SHARE: Final = 0.7
"""Share of the stated rate from which it counts as kept."""


@dataclass(frozen=True, slots=True)
class Rate:
    """Frames a second that arrive, and that the sequence states."""

    delivered_hz: float
    stated_hz: float

    @property
    def kept(self) -> bool:
        """Whether about as many arrive as are stated."""
        return self.delivered_hz >= KEPT_SHARE * self.stated_hz

    def __str__(self) -> str:
        """As in "the camera does not keep its rate: 2.1 of 10.6 frames/s arrive"."""
        keeps = "keeps" if self.kept else "does not keep"
        rates = f"{self.delivered_hz:.3g} of {self.stated_hz:.3g} frames/s arrive"
        return f"the camera {keeps} its rate: {rates}"

    def to_document(self) -> dict[str, float]:
        """Return it as a map."""
        return {"delivered_hz": self.delivered_hz, "stated_hz": self.stated_hz}


def measured_rate(device: Device) -> Rate:
    """Stream frames of one small product, and count those that come in the time of the camera.

    Raises PromiseBroken if none come.
    """
    with device.capturing(), device.stream("flags") as stream:
        stated_hz = float(device.sequence["frame_rate_hz"])
        times_s = [float(stream.frame().meta["host_time_s"]) for _ in range(_FRAMES)]
    elapsed_s = times_s[-1] - times_s[0]
    delivered_hz = (_FRAMES - 1) / elapsed_s if elapsed_s > 0 else stated_hz
    return Rate(delivered_hz, stated_hz)


Outcome = Literal["passed", "failed", "skipped"]


@dataclass(frozen=True, slots=True)
class Result:
    """The result of one check."""

    check: Check
    outcome: Outcome
    reason: str | None
    """Why it failed or was skipped; None if it passed."""
    duration_s: float

    def to_document(self) -> dict[str, Any]:
        """Return it as a map."""
        return {
            "group": self.check.group,
            "name": self.check.name,
            "promise": self.check.promise,
            "outcome": self.outcome,
            "reason": self.reason,
            "duration_s": round(self.duration_s, 3),
        }


@dataclass(frozen=True, slots=True)
class Report:
    """The results of all checks."""

    url: str
    camera: Mapping[str, Any]
    """Model, serial and firmware of the camera, name and version of its service; empty if they
    could not be read."""
    began_s: float
    """Unix time."""
    duration_s: float
    results: Sequence[Result]
    slow: Rate | None = None
    """The camera's rate where it did not keep it, and checks were skipped for that."""

    @property
    def counts(self) -> dict[str, int]:
        """How many checks had each outcome."""
        counted = Counter(each.outcome for each in self.results)
        return {name: counted[name] for name in ("passed", "failed", "skipped")}

    @property
    def failed(self) -> tuple[Result, ...]:
        """Promises that are not kept."""
        return tuple(each for each in self.results if each.outcome == "failed")

    def to_document(self) -> dict[str, Any]:
        """Return it as a map that JSON can hold."""
        return {
            "url": self.url,
            "camera": dict(self.camera),
            "began_s": self.began_s,
            "duration_s": round(self.duration_s, 3),
            **self.counts,
            "slow": None if self.slow is None else self.slow.to_document(),
            "checks": [each.to_document() for each in self.results],
        }


CHECKS: Final[tuple[Check, ...]] = (
    *checks("routes", routes),
    *checks("problems", problems),
    *checks("parameters", parameters),
    *checks("tags", tags),
    *checks("lease", leasing),
    *checks("stream", streaming),
    *checks("slow-readers", slow_readers),
    *checks("resume", resuming),
    *checks("sizes", sizes),
    *checks("recording", recording),
    *checks("unplug", unplugging),
    *checks("authentication", authentication),
)
"""Every check, in the order they are run."""
GROUPS: Final = tuple(dict.fromkeys(each.group for each in CHECKS))
SLOW: Final = ("slow-readers", "resume", "sizes", "recording", "unplug")
"""Groups that take long, and that ``quick`` leaves out."""
_TIMED: Final = ("stream", "slow-readers", "resume", "recording")
"""Groups whose promises can be tried only where frames arrive at about their rate."""
_LEFT: Final = Check(
    "afterwards",
    "the-camera-is-left-as-it-was",
    "Sequence, reconstruction and acquisition are set as they were before the checks.",
    lambda device: None,
)
_MALFORMED: Final = (KeyError, IndexError, TypeError, ValueError, AttributeError)
"""Errors of reading a document that has not the form it should have."""


def chosen(groups: Collection[str], *, quick: bool = False) -> tuple[Check, ...]:
    """Return the checks of some groups; of all, where none is named, or all quick ones.

    Raises ParameterError if there is no such group.
    """
    for each in groups:
        if each not in GROUPS:
            raise ParameterError("only", each, f"one of {', '.join(GROUPS)}")
    wanted = groups or [each for each in GROUPS if not (quick and each in SLOW)]
    return tuple(each for each in CHECKS if each.group in wanted)


def run(
    device: Device,
    checks: Sequence[Check] = CHECKS,
    *,
    begin: Callable[[Check], object] = lambda check: None,
    end: Callable[[Result], object] = lambda result: None,
    rate: Callable[[Device], Rate] = measured_rate,
    clock: Callable[[], float] = time.monotonic,
    unix_s: Callable[[], float] = time.time,
) -> Report:
    """Try every check in turn, and report.

    ``begin`` and ``end`` are called with each check and its result. Where a check fails whose
    promise rests on frames that arrive in time, ``rate`` measures whether they do; it is skipped,
    and the report says so, where the camera (or a laden machine) does not keep its rate.
    Raises ServerUnreachable, ProblemError, ProtocolError if no camera answers at the address.
    """
    began_s, start_s = unix_s(), clock()
    camera = _identity(device)
    before = _settings(device)
    results: list[Result] = []
    slow: Rate | None = None
    for check in checks:
        begin(check)
        result = _try(check, device, clock)
        if result.outcome == "failed" and check.group in _TIMED:
            found = _slow_rate(rate, device)
            if found is not None:
                slow = found
                result = replace(result, outcome="skipped", reason=f"{slow}. {result.reason}")
        results.append(result)
        end(result)
    begin(_LEFT)
    results.append(_left_as(before, device))
    end(results[-1])
    return Report(device.address.url, camera, began_s, clock() - start_s, results, slow)


def _slow_rate(rate: Callable[[Device], Rate], device: Device) -> Rate | None:
    """Return the rate where it is not kept; None where it is, or nothing can be said of it."""
    try:
        found = rate(device)
    except (TransientcamError, *_MALFORMED):
        return None  # no frame at all is no slow one
    return None if found.kept else found


def _try(check: Check, device: Device, clock: Callable[[], float]) -> Result:
    start_s = clock()
    outcome: Outcome = "passed"
    reason = None
    try:
        check.run(device)
    except CheckSkipped as skipped:
        outcome, reason = "skipped", str(skipped)
    except TransientcamError as error:
        outcome, reason = "failed", str(error)
    except _MALFORMED as error:
        outcome, reason = "failed", f"an answer is not as documented: {error!r}"
    return Result(check, outcome, reason, clock() - start_s)


def _identity(device: Device) -> dict[str, Any]:
    """Return the names of camera and service; a wrong address fails here, at the first request."""
    device.send("GET", "/livez")
    try:
        info, camera = device.read(f"{API}/info"), device.camera["capabilities"]
        names = {key: camera[key] for key in ("model", "serial", "firmware")}
        return {"service": info["name"], "version": info["version"], **names}
    except (TransientcamError, *_MALFORMED):
        return {}  # the checks report it in detail


def _settings(device: Device) -> Mapping[str, Any] | None:
    try:
        return device.state()
    except (TransientcamError, *_MALFORMED):
        return None


def _left_as(before: Mapping[str, Any] | None, device: Device) -> Result:
    if before is None:
        return Result(_LEFT, "skipped", "its settings could not be read before", 0.0)
    after = _settings(device)
    if after == before:
        return Result(_LEFT, "passed", None, 0.0)
    return Result(_LEFT, "failed", f"it was {before} and is {after}", 0.0)
