"""All checks, and the running of them against one camera."""

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

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
from transientcam_conformance._check import Check, checks
from transientcam_conformance._device import API, Device
from transientcam_conformance._rate import Rate, measured_rate
from transientcam_conformance._report import Outcome, Report, Result

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
