"""The findings of ``transientcam doctor``, and the checks that yield them.

Each package offers its own checks as an entry point of the group ``transientcam.checks``: a
function that takes ``config`` (the file of settings, or None) and yields tuples ``(level, check,
message, remedy)``. One of the group ``transientcam.camera-checks`` takes a camera's name instead.
Only installed packages have any.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, Final, Literal

GROUP: Final = "transientcam.checks"
CAMERA_GROUP: Final = "transientcam.camera-checks"

Level = Literal["ok", "warning", "fault", "not tried"]
Reported = tuple[str, str, str, str | None]
"""A finding as a plain tuple, which other packages yield without importing this one."""
Checks = Callable[[], Iterable[Reported]]


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of one check."""

    level: Level
    """``fault``: a part will not work; ``warning``: it will, but not fully or not as well;
    ``not tried``: nobody knows, for the reason in the message."""
    check: str
    """What was checked."""
    message: str
    """What was found."""
    remedy: str | None = None
    """What to do about it; None where there is nothing to do."""

    def to_document(self) -> dict[str, Any]:
        """Return what ``--json`` prints."""
        return asdict(self)


def of_this_machine(config: Path | None) -> Iterator[Finding]:
    """Run the checks of every installed package."""
    yield from _installed(GROUP, config)


def of_camera(spec: str) -> Iterator[Finding]:
    """Run the checks of one camera, of every package that has any."""
    yield from _installed(CAMERA_GROUP, spec)


def of_kinect2(root: Path) -> Iterator[Finding]:
    """Run the checks of what a Kinect v2 needs of a machine."""
    yield from _installed("transientcam.kinect2-checks", root)


def absent_in_words(reasons: Mapping[str, str]) -> Iterator[str]:
    """Yield a sentence for each reason why products are absent, with the names of these."""
    names: dict[str, list[str]] = {}
    for product, reason in reasons.items():
        names.setdefault(reason, []).append(product)
    if not names:
        yield "all of them can be had"
    for reason, products in names.items():
        yield f"no {', '.join(products)}: {reason}"


def _installed(group: str, argument: object) -> Iterator[Finding]:
    for point in sorted(entry_points(group=group), key=lambda each: each.name):
        try:
            checks = point.load()
        except ModuleNotFoundError as error:
            message = f"not installed ({error.name} is missing)"
            remedy = f"pip install 'transientcam[{point.name}]'"
            yield Finding("not tried", point.name, message, remedy)
            continue
        yield from guarded(point.name, partial(checks, argument))


def guarded(name: str, checks: Checks) -> Iterator[Finding]:
    """Run some checks; one that fails is a finding itself and ends only these."""
    try:
        for level, check, message, remedy in checks():
            yield Finding(_level(level), check, message, remedy)
    except Exception as error:
        message = f"could not be checked: {type(error).__name__}: {error}"
        yield Finding("fault", name, message, "this is a mistake in transientcam: please report it")


def _level(text: str) -> Level:
    match text:
        case "ok" | "warning" | "fault" | "not tried":
            return text
        case _:
            raise ValueError(text)
