"""Which of the devices on a bus is meant by a name, and which is the one that was lost."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from transientcam_driver.camera._plugin import FoundCamera
from transientcam_driver.errors import CameraError, CameraLost, CameraNotFound

Opened = TypeVar("Opened")


@dataclass(frozen=True, slots=True)
class Plugged:
    """A device as it was found: ``device`` of the library that found it, or why it is none to open.

    ``place`` is bus and ports, as in ``@1-2.4``; ``serial`` is empty where none can be read.
    """

    place: str
    serial: str
    node: str
    device: Any = None
    product: str | None = None
    problem: CameraError | None = None


def place_on(bus: int, ports: Sequence[int] | None, address: int) -> str:
    """Return where a device is; where its ports are not known by its address, which may change."""
    return f"@{bus}-{'.'.join(map(str, ports or ('device', address)))}"


def listed(kind: str, found: Sequence[Plugged]) -> tuple[FoundCamera, ...]:
    """Return what `transientcam devices` shows: each by a name that opens no other.

    That is its serial number, or its place where another one has the same, or it has none.
    """
    serials = [each.serial for each in found]
    unique = {each for each in serials if each and serials.count(each) == 1}
    return tuple(
        FoundCamera(
            f"{kind}:{each.serial if each.serial in unique else each.place}",
            each.serial or None,
            each.product,
            each.node,
            None if each.problem is None else str(each.problem),
        )
        for each in found
    )


class SameDevice(Generic[Opened]):
    """Opens a device by its name, and once that is lost no other, not even one of its number.

    One with a serial number may come back in another place; one without, or one whose twin is
    plugged in as it is lost, comes back where it was, since nothing else tells them apart.

    ``name`` is a serial number, a place, or None for the first that can be opened; ``look`` returns
    the devices of this ``kind`` that are plugged in. ``claim`` opens one of them, and is also given
    what stands behind its serial number where that does not tell it from another one: its place.
    """

    def __init__(
        self,
        kind: str,
        name: str | None,
        look: Callable[[], Sequence[Plugged]],
        claim: Callable[[Plugged, str], Opened],
    ) -> None:
        self._kind, self._name = kind, name
        self._look, self._claim = look, claim
        self._by_place = name is not None and name.startswith("@")
        self._had: Plugged | None = None
        self._lost = False
        self._twins: set[str] = set()
        """Places where another one with its number was seen."""

    def __call__(self, _serial: str | None = None) -> Opened:
        """Find and open it.

        Raises CameraError saying why the last one that might have been it could not be opened,
        `CameraNotFound`, or that several have this serial number.
        """
        trouble: CameraError = CameraNotFound(self._name)
        found = self._look()
        for each in self._meant(found):
            try:
                if each.problem is not None:
                    raise each.problem
                opened = self._claim(each, each.place if self._by_place or not each.serial else "")
            except (CameraLost, CameraNotFound):
                continue  # it was unplugged meanwhile
            except CameraError as error:
                trouble = error
                continue
            self._had, self._lost = each, False
            self._twins = (self._twins | self._places(found)) - {each.place}
            return opened
        raise trouble

    def _meant(self, found: Sequence[Plugged]) -> Iterator[Plugged]:
        """Yield what may be it; what has a problem may be, where its number is not known."""
        if self._had is None:
            same = [each for each in found if each.serial and each.serial == self._name]
            if len(same) > 1:
                places = " or ".join(f"{self._kind}:{each.place}" for each in same)
                reason = f"several cameras have the serial number {self._name}: name {places}"
                raise CameraError(reason)
            for each in found:
                unknown = each.problem is not None and not self._by_place and not same
                if self._name in (None, each.serial, each.place) or unknown:
                    yield each
            return
        had, alike = self._had, self._places(found)
        if not self._lost:  # the first look after it was lost: what is elsewhere by now is not it
            self._lost = True
            self._twins |= alike - {had.place}
        here = {had.place, *(alike - self._twins)}
        for each in found:
            if each.place in here and (each.serial == had.serial or each.problem is not None):
                yield each

    def _places(self, found: Sequence[Plugged]) -> set[str]:
        serial = "" if self._had is None else self._had.serial
        return {each.place for each in found if each.serial and each.serial == serial}
