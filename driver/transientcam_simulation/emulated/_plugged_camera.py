"""An emulated camera at a cable: one link to it at a time, faults, and a plug."""

import threading
from abc import ABC, abstractmethod
from typing import Generic, TypeVar

from transientcam_driver.errors import CameraBusy, CameraLost, CameraNotFound
from transientcam_simulation.emulated._open_usb import Fault, PendingFaults

Link = TypeVar("Link")


class PluggedCamera(ABC, Generic[Link]):
    """What emulated cameras below the seam of their drivers have in common.

    ``spec``: its name for `open_camera`.
    ``product``: what it is called.
    ``changed``: held while anything here changes, and notified of it.
    ``plugged``: whether the cable is in.
    """

    def __init__(self, spec: str, product: str) -> None:
        self._spec = spec
        self._faults = PendingFaults(product, Fault.DROP, Fault.CORRUPT_PIXELS)
        self._link: Link | None = None
        self.changed = threading.Condition()
        self.plugged = True

    @abstractmethod
    def _power_on(self) -> None:
        """Begin as behind a plug."""

    @abstractmethod
    def _new_link(self) -> Link:
        """Return a link to this camera."""

    def connect(self) -> Link:
        """Open the camera.

        Raises CameraNotFound where the cable is out; CameraBusy where it is open already.
        """
        with self.changed:
            if not self.plugged:
                raise CameraNotFound
            if self._link is not None:
                raise CameraBusy(self._spec)
            self._link = self._new_link()
            return self._link

    def release(self, link: Link) -> None:
        """Take note that a link was closed."""
        with self.changed:
            if self._link is link:
                self._link = None

    def is_at(self, link: Link) -> bool:
        """Whether a link leads to this camera still."""
        return self._link is link

    def require(self, link: Link) -> None:
        """Refuse a link that does not lead here any more (CameraLost)."""
        if not self.is_at(link):
            raise CameraLost("it is not plugged in any more")

    def unplug(self) -> None:
        """Pull the cable, and with it the power."""
        with self.changed:
            self.plugged = False
            self._link = None
            self.changed.notify_all()

    def replug(self) -> None:
        """Plug the cable in again: power-up. No effect on a plugged one."""
        with self.changed:
            if not self.plugged:
                self._power_on()
                self.plugged = True

    def inject(self, fault: Fault, images: int = 1) -> None:
        """Let a fault happen to the next images.

        Raises CameraError where this camera knows no such fault.
        """
        with self.changed:
            self._faults.inject(fault, images)
