"""The server's checks of ``transientcam doctor``: whether `transientcam serve` could run here.

Findings are tuples ``(level, check, message, remedy)``, as that verb's entry points give them.
"""

import os
import resource
import shutil
import sys
import tempfile
from collections.abc import Iterator
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Final

import httpx

import transientcam_moments as tm
from transientcam.errors import TransientcamError
from transientcam.transport import translated
from transientcam_compiled import python
from transientcam_moments.plugins import GROUPS
from transientcam_server.daemon._configuration import load_settings
from transientcam_server.daemon._server import listen
from transientcam_server.errors import AddressUnavailable, SettingsError
from transientcam_server.settings import Settings
from transientcam_supervisor import OffSwitch, Supervisor, SupervisorEnded

Reported = tuple[str, str, str, str | None]

_OLDEST: Final = (3, 11)
_SPARE_DESCRIPTORS: Final = 64
_ASK_S: Final = 2.0
_CHECKED_HARMONICS: Final = 4
_REINSTALL: Final = "pip install --force-reinstall 'transientcam[server]'"


def checks(config: Path | None = None) -> Iterator[Reported]:
    """Look at libraries, kernels, settings, directories, disk, limits and the port."""
    yield from _libraries()
    yield _kernels()
    yield from _devices()
    yield _supervisor()
    yield from _plugins()
    try:
        settings = load_settings({}, file=config, environment=os.environ)
    except SettingsError as error:
        for mistake in error.mistakes:
            yield "fault", "settings", str(mistake), "docs/settings.md lists all of them"
        return
    yield "ok", "settings", f"valid; the camera is {settings.camera}", None
    if not (settings.needs_token or settings.on_loopback):
        message = (
            f"every client that reaches {settings.host}, port {settings.port}, controls the camera"
        )
        yield "warning", "access", message, "make tokens, and leave insecure out"
    yield from _directories(settings)
    yield _disk(settings)
    yield _descriptors(settings)
    yield _port(settings)


def _libraries() -> Iterator[Reported]:
    if sys.version_info < _OLDEST:
        oldest = ".".join(map(str, _OLDEST))
        yield "fault", "Python", f"older than {oldest}", f"install Python {oldest} or newer"
    found = []
    for name in ("numba", "scipy", "h5py", "fastapi", "uvicorn"):
        try:
            import_module(name)
        except Exception as error:
            # numba refuses a NumPy newer than it supports with its own error; without it
            # everything works, only slower
            level = "warning" if name == "numba" else "fault"
            yield level, "packages", f"{name} cannot be imported: {error}", _REINSTALL
        else:
            found.append(f"{name} {version(name)}")
    yield "ok", "packages", ", ".join(found), None


def _plugins() -> Iterator[Reported]:
    for offered in GROUPS.values():
        for name, found in offered.statements().items():
            if isinstance(found, tm.PluginFailed):
                yield "warning", f"{offered.kind}s", str(found), "docs/add-an-estimator.md"
            else:
                says = getattr(found, "label", "") or found.summary
                yield "ok", f"{offered.kind}s", f"{name}, of another package: {says}", None


def _kernels() -> Reported:
    if not tm.kernels.state()["enabled"]:
        message = "off (TRANSIENTCAM_KERNELS): NumPy computes everything, several times slower"
        return "warning", "kernels", message, "unset TRANSIENTCAM_KERNELS"
    directory = tm.kernels.cache_directory()
    if directory is None:
        message = "there is nowhere to keep them: each start compiles them anew, for minutes"
        return "warning", "kernels", message, "set NUMBA_CACHE_DIR to a directory to write into"
    compiled = sum(1 for _ in directory.rglob("*.nbi"))
    if not compiled:
        message = f"not compiled yet; the daemon does so as it starts, into {directory}"
        return "warning", "kernels", message, "transientcam compile does it now"
    return "ok", "kernels", f"{compiled} functions are kept in {directory}", None


def _devices() -> Iterator[Reported]:
    """Name the adapters, each of which computes a known frame."""
    try:
        found = tm.kernels.devices(_CHECKED_HARMONICS)
    except tm.DeviceUnavailable as error:
        yield "ok", "devices", f"frames are computed on the processor: {error.reason}", None
        return
    for each in found:
        said = each.refused or f"{each.name} ({each.kind}, {each.backend}) can be used"
        yield "warning" if each.refused else "ok", "devices", said, "docs/gpu.md"


def _supervisor() -> Reported:
    supervisor = Supervisor(python(), silence_s=1.0)
    try:
        supervisor.watch(OffSwitch())
    except SupervisorEnded as error:
        message = f"{error}: cameras with a light of their own stay dark"
        return "fault", "supervisor", message, _REINSTALL
    supervisor.close(dark=True)
    return "ok", "supervisor", "a process that switches the light off can be started", None


def _directories(settings: Settings) -> Iterator[Reported]:
    yield _directory("recordings", settings.recordings.directory, "recordings.directory")
    yield _directory("calibrations", settings.calibrations.directory, "calibrations.directory")
    yield _directory("light", settings.light.directory, "light.directory")
    tokens = settings.tokens_file
    if tokens.exists() and not os.access(tokens, os.W_OK):
        message = f"{tokens} can be read, but not changed"
        yield "warning", "tokens", message, "make and revoke tokens as the user it belongs to"
    elif not tokens.exists():
        yield "ok", "tokens", f"there are none ({tokens}): only this machine may come in", None
    else:
        yield "ok", "tokens", str(tokens), None


def _directory(check: str, directory: Path, setting: str) -> Reported:
    """Whether something can be written there, or it can be made; nothing is left behind."""
    nearest = _nearest(directory)
    try:
        with tempfile.TemporaryFile(dir=nearest):
            pass
    except OSError as error:
        message = f"cannot write into {nearest}: {error.strerror}"
        return "fault", check, message, f"let this user write there, or set {setting}"
    state = "" if nearest == directory else ", which is made when it is needed"
    return "ok", check, f"{directory}{state}", None


def _nearest(directory: Path) -> Path:
    """Return the directory itself, or the first above it that there is."""
    return next(each for each in (directory, *directory.absolute().parents) if each.exists())


def _disk(settings: Settings) -> Reported:
    nearest = _nearest(settings.recordings.directory)
    free, least = shutil.disk_usage(nearest).free, settings.recordings.min_free_bytes
    if free <= least:
        message = f"{free / 1e9:.1f} GB free at {nearest}: nothing would be recorded"
        remedy = f"free more than {least / 1e9:.1f} GB, or set recordings.min_free_bytes"
        return "warning", "disk", message, remedy
    return "ok", "disk", f"{free / 1e9:.1f} GB free at {nearest}", None


def _descriptors(settings: Settings) -> Reported:
    allowed, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    needed = settings.limits.max_connections + _SPARE_DESCRIPTORS
    if allowed != resource.RLIM_INFINITY and allowed < needed:
        message = f"{allowed} may be open, {settings.limits.max_connections} connections need more"
        return "warning", "files", message, f"ulimit -n {needed}, or lower limits.max_connections"
    return "ok", "files", f"{allowed} may be open", None


def _port(settings: Settings) -> Reported:
    try:
        listen(settings.host, settings.port).close()
    except AddressUnavailable as error:
        who = _who_answers(settings)
        if who is not None:
            return "ok", "port", who, None
        return "fault", "port", str(error), f"ss -ltnp 'sport = {settings.port}' names the process"
    return "ok", "port", f"{settings.host}, port {settings.port} is free", None


def _who_answers(settings: Settings) -> str | None:
    """Return which transientcam daemon has the port; None where it is another program."""
    scheme = "https" if settings.tls_certificate is not None else "http"
    host = "127.0.0.1" if settings.host in ("0.0.0.0", "::") else settings.host  # noqa: S104
    url = f"{scheme}://{f'[{host}]' if ':' in host else host}:{settings.port}"
    try:
        # whose certificate it is does not matter here, and nothing secret is sent
        with translated(url), httpx.Client(verify=False, timeout=_ASK_S) as http:  # noqa: S501
            found = http.get(f"{url}/api/versions").json()
            return f"{found['name']} {found['version']} serves at {url}"
    except (TransientcamError, ValueError, KeyError, TypeError):
        return None
