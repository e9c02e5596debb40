"""Open a camera by its name, ``NAME:ADDRESS?option=value``, through the plug-in of that name."""

from importlib.metadata import EntryPoint, entry_points
from typing import Final

from transientcam_driver.camera._camera import Camera
from transientcam_driver.camera._plugin import GROUP, CameraName, CameraPlugin
from transientcam_driver.clock import Clock, RealClock
from transientcam_driver.errors import DriverError, PluginError, SpecError

DEFAULT_SPEC: Final = "sim:mirrors"


def open_camera(spec: str = DEFAULT_SPEC, *, clock: Clock | None = None) -> Camera:
    """Open a camera, real, simulated or recorded; the caller closes it.

    Parameters
    ----------
    spec
        ``NAME:ADDRESS?option=value``, where NAME is an entry of the group ``transientcam.cameras``:
        ``usb:SERIAL``, ``sim:SCENE?width=320&height=240``, ``tofcam660:192.168.10.31``,
        ``recording:FILE``, or that of another package. `transientcam devices` lists all of them.
    clock
        The clock of a simulated camera; real time by default.

    Raises
    ------
    SpecError
        The name is not valid.
    PluginError
        The plug-in of that name cannot be used.
    SceneError
        The scene is not valid.
    CameraError
        The camera is absent, busy, or may not be opened.
    """
    name, plugin = plugin_of(spec)
    try:
        camera = plugin.open(name, clock or RealClock())
    except (Exception, SystemExit) as error:  # of a package that is not ours
        # a package's own kinds, and the system's, are meant to be read
        own = _package(type(error)) == _package(plugin.open)
        if own or isinstance(error, OSError | DriverError):
            raise
        raise PluginError(name.kind, f"open() raised {error!r:.200}") from error
    if not hasattr(camera, "read_frame"):
        raise PluginError(name.kind, f"open() returned {camera!r:.60}, no Camera")
    return camera


def check_camera(spec: str) -> None:
    """Read what a camera's name names, without opening the camera.

    Raises DriverError as `open_camera`, as far as it can be known.
    """
    name, plugin = plugin_of(spec)
    plugin.check(name)


def _package(of: object) -> str:
    return str(getattr(of, "__module__", "")).partition(".")[0]


def kinds() -> tuple[str, ...]:
    """Return the names of all plug-ins, which a camera's name begins with."""
    return tuple(sorted({point.name for point in entry_points(group=GROUP)}))


def plugin_of(spec: str) -> tuple[CameraName, CameraPlugin]:
    """Take a name apart, and return the plug-in that opens it.

    Raises SpecError, PluginError as `open_camera`.
    """
    name = CameraName.parse(spec)
    points = {point.value: point for point in entry_points(group=GROUP, name=name.kind)}
    if not points:
        raise SpecError(spec, f"no camera is called {name.kind!r}; known are {', '.join(kinds())}")
    if len(points) > 1:
        raise PluginError(name.kind, f"several packages offer it: {', '.join(sorted(points))}")
    plugin = _load(next(iter(points.values())))
    plugin.require_options(name)
    return name, plugin


def _load(point: EntryPoint) -> CameraPlugin:
    """Import the plug-in of an entry point.

    Raises PluginError where it cannot be imported, or is something else.
    """
    try:
        plugin = point.load()
    except ModuleNotFoundError as error:
        raise PluginError(point.name, f"the package {error.name} is not installed") from error
    except (Exception, SystemExit) as error:  # of a package that is not ours
        reason = f"{point.value} cannot be imported: {type(error).__name__}: {error}"
        raise PluginError(point.name, reason) from error
    if not isinstance(plugin, CameraPlugin):
        reason = f"{point.value} is a {type(plugin).__name__}, not a CameraPlugin"
        raise PluginError(point.name, reason)
    return plugin
