"""What a camera's package offers, so that `open_camera` and `transientcam devices` know it.

A package names a `CameraPlugin` in the entry-point group ``transientcam.cameras``; the entry's name
is the first part of the camera's name, ``NAME:ADDRESS?option=value``.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final
from urllib.parse import parse_qsl

from transientcam_driver.camera._camera import Camera
from transientcam_driver.clock import Clock
from transientcam_driver.errors import SpecError

GROUP: Final = "transientcam.cameras"


@dataclass(frozen=True, slots=True)
class CameraName:
    """A camera's name, taken apart.

    Attributes
    ----------
    spec
        The whole name, as it was given.
    kind
        Which plug-in opens it.
    address
        Which of its cameras; empty for any.
    options
        What was written behind the question mark.
    """

    spec: str
    kind: str
    address: str = ""
    options: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def parse(cls, spec: str) -> "CameraName":
        """Take ``NAME:ADDRESS?option=value&option=value`` apart."""
        name, _, query = spec.partition("?")
        kind, _, address = name.partition(":")
        return cls(spec, kind, address, dict(parse_qsl(query, keep_blank_values=True)))

    def choice(self, option: str, allowed: Iterable[str]) -> str:
        """Return an option's value, the first allowed one without it.

        Raises
        ------
        SpecError
            It has another value.
        """
        known = tuple(allowed)
        value = self.options.get(option, known[0])
        if value not in known:
            raise self.refused(option, f"one of {', '.join(known)}")
        return value

    def integer(self, option: str, default: int, *, least: int = 0, most: int = 2**63) -> int:
        """Return an option's value as an integer.

        Raises
        ------
        SpecError
            It is none, or beyond the limits.
        """
        text = self.options.get(option, str(default))
        if not (text.isascii() and text.isdigit() and len(text) < 20):
            raise self.refused(option, f"an integer of at least {least}")
        if not least <= int(text) <= most:
            raise self.refused(option, f"an integer from {least} to {most}")
        return int(text)

    def number(self, option: str, default: float, *, least: float, most: float) -> float:
        """Return an option's value as a number.

        Raises
        ------
        SpecError
            It is none, or beyond the limits.
        """
        limit = f"a number from {least:g} to {most:g}"
        try:
            value = float(self.options.get(option, default))
        except ValueError as error:
            raise self.refused(option, limit) from error
        if not least <= value <= most:  # also NaN
            raise self.refused(option, limit)
        return value

    def refused(self, option: str, limit: str) -> SpecError:
        """Return the error for an option's value."""
        return SpecError(self.spec, f"{option} = {self.options.get(option)!r}: must be {limit}")


@dataclass(frozen=True, slots=True)
class FoundCamera:
    """A camera that a plug-in found.

    Attributes
    ----------
    spec
        The name that opens it.
    serial, product
        None where they cannot be read without disturbing it.
    node
        Where it is: a device node, a network address.
    problem
        Why it cannot be opened, or None.
    simulated
        Whether it is a simulation, which is always there.
    """

    spec: str
    serial: str | None = None
    product: str | None = None
    node: str | None = None
    problem: str | None = None
    simulated: bool = False


def _none_found() -> tuple[FoundCamera, ...]:
    return ()


def _nothing_to_check(name: CameraName) -> None:
    pass


def _no_facts(name: CameraName) -> tuple[tuple[str, str], ...]:
    return ()


@dataclass(frozen=True, slots=True)
class CameraPlugin:
    """One kind of camera: how to find one, and how to open it.

    Attributes
    ----------
    summary
        What it is, in a few words.
    usage
        How a name is written, as in ``usb[:SERIAL]``.
    open
        Opens the camera of a name. The clock is real time, unless a test has another one; a real
        device may leave it aside. Raises a `DriverError`: `CameraNotFound`, `CameraBusy` and so on.
    find, find_on_network
        List the cameras that are at this machine, and those on the network, within about a second
        and without disturbing any. Raise a `DriverError` where that is impossible.
    check
        Checks a name without opening the camera, as `transientcam serve --check` does.
    facts
        Reads what a report of a fault should hold, as pairs of a name and a text, for
        `transientcam doctor --camera`.
    options
        What each option means, by its name; others are refused before ``open`` is called.
    """

    summary: str
    usage: str
    open: Callable[[CameraName, Clock], Camera]
    find: Callable[[], Iterable[FoundCamera]] = _none_found
    find_on_network: Callable[[], Iterable[FoundCamera]] = _none_found
    check: Callable[[CameraName], None] = _nothing_to_check
    facts: Callable[[CameraName], Iterable[tuple[str, str]]] = _no_facts
    options: Mapping[str, str] = field(default_factory=dict)

    def require_options(self, name: CameraName) -> None:
        """Refuse options that there are not.

        Raises
        ------
        SpecError
            Naming the first one, and those that there are.
        """
        for option in name.options:
            if option not in self.options:
                known = f"known are {', '.join(self.options)}" if self.options else "there are none"
                raise SpecError(name.spec, f"unknown option {option!r}; {known}")
