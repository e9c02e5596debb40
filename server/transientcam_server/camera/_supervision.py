"""Who switches the light off where the thread that owns the camera cannot: another process."""

from collections.abc import Callable

from transientcam_compiled import python
from transientcam_driver import Camera, CameraError
from transientcam_driver.camera import has_light
from transientcam_supervisor import Supervisor, SupervisorEnded


class Supervision:
    """A supervisor of a camera's light; none where there is no light, or it has no off switch.

    For the thread that owns the camera.

    ``camera``: whose light it is; None for none.
    ``silence_s``: the light goes off after so long without a `beat`.
    """

    def __init__(self, camera: Camera | None, *, silence_s: float) -> None:
        self._camera = camera if camera is not None and has_light(camera) else None
        self._supervisor = Supervisor(python(), silence_s=silence_s)

    def starting(self) -> str | None:
        """Have the camera watched before its light is switched on; as `beat`.

        Raises CameraError where there is no supervisor; the light has to stay off.
        """
        switch = None if self._camera is None else self._camera.off_switch
        if switch is None or not switch.steps:
            return None
        try:
            self._supervisor.watch(switch)
        except SupervisorEnded as error:
            raise CameraError(f"the light stays off: {error}") from error
        return self._told(self._supervisor.starting)

    def beat(self, *, lit: bool) -> str | None:
        """Say that the light is under control; return why it has to be off until somebody starts.

        ``lit``: whether it may be on.
        """
        return self._told(self._supervisor.alive if lit else self._supervisor.dark)

    def lost(self) -> str | None:
        """Switch the light off by all means: how the camera stands is not known; as `beat`."""
        if self._camera is None:
            return None
        try:
            self._camera.stop()  # also so that `reconnect` does not start it unwatched
        except CameraError:
            return self._told(self._supervisor.switch_off)
        return self.beat(lit=False)

    def close(self, *, dark: bool) -> None:
        """Need it no more; where the light is not known to be off, it is to switch it off."""
        self._supervisor.close(dark=dark)

    @staticmethod
    def _told(tell: Callable[[], str | None]) -> str | None:
        try:
            return tell()
        except SupervisorEnded as error:
            return str(error)
