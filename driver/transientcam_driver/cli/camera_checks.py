"""Checks of one camera for ``transientcam doctor --camera``: its facts, and the contract.

Findings are tuples ``(level, check, message, remedy)``, as that verb's entry points yield them.
"""

from collections.abc import Iterator
from dataclasses import asdict
from typing import Final

from transientcam_driver.camera import light_warning, open_camera, plugin_of
from transientcam_driver.contract import CLAUSES, Bench, ContractBroken, ContractSkipped
from transientcam_driver.errors import DriverError
from transientcam_driver.texts import in_celsius

Reported = tuple[str, str, str, str | None]

_FRAMES: Final = 3
_UNWATCHED: Final = "docs/operations.md says what switches the light off, and after how long"
_BADGE: Final = "![camera contract](https://img.shields.io/badge/contract-{}_passed,_{}_failed,_{}_not_tried-{})"
_REPORT: Final = "send this whole report, with --json, to the maintainer of the plug-in"


def checks(spec: str) -> Iterator[Reported]:
    """Read what a camera says of itself, capture a few frames, and hold it to the contract.

    Its light is on while frames are captured. The sequence that it has afterwards is its own.
    """
    try:
        name, plugin = plugin_of(spec)
        for fact, text in plugin.facts(name):
            yield "ok", fact, text, None
        yield from _capabilities(spec)
    except DriverError as error:
        yield "fault", "camera", str(error), None
        return
    bench = Bench.of(spec)
    ended = dict.fromkeys(("ok", "fault", "not tried"), 0)
    for clause in CLAUSES:
        level, message, remedy = "ok", clause.promise, None
        try:
            clause.run(bench)
        except ContractSkipped as skipped:
            level, message = "not tried", str(skipped)
        except ContractBroken as broken:
            level, message, remedy = "fault", f"{clause.promise} But: {broken}", _REPORT
        ended[level] += 1
        yield level, clause.name, message, remedy
    colour = "red" if ended["fault"] else "yellow" if ended["not tried"] else "green"
    yield "ok", "for a README", _BADGE.format(*ended.values(), colour), None


def _capabilities(spec: str) -> Iterator[Reported]:
    with open_camera(spec) as camera:
        can = camera.capabilities
        yield "ok", "camera", f"{can.model} {can.serial}, firmware {can.firmware}", None
        stated = ", ".join(f"{name}={value}" for name, value in asdict(can).items())
        yield "ok", "can do", stated, None
        if (warning := light_warning(camera)) is not None:
            yield "warning", "light", warning, _UNWATCHED
        applied = camera.applied
        camera.start()
        first = camera.read_frame(timeout_s=_time_s(applied.frame_rate_hz))
        rest = [camera.read_frame(timeout_s=_time_s(applied.frame_rate_hz)) for _ in range(_FRAMES)]
        took_s = (rest[-1].device_time_s - first.device_time_s) / _FRAMES
        rates = f"{1 / took_s:.3g} frames/s, stated {applied.frame_rate_hz:.3g}"
        lost = f"{camera.counters.lost} images lost, {in_celsius(rest[-1].temperature_c)}"
        yield "ok", "frames", f"{applied.images} images each, {rates}; {lost}", None
        spread = (
            f"{int(image.min())}..{int(image.max())} (mean {float(image.mean()):.0f})"
            for image in rest[-1].images[:4]
        )
        yield "ok", "first images", f"in DN: {', '.join(spread)}", None


def _time_s(frame_rate_hz: float) -> float:
    return 10.0 + 5.0 / frame_rate_hz
