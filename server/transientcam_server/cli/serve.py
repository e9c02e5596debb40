"""The verb ``serve`` of the ``transientcam`` command."""

import json
import logging
import os
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from transientcam.cli.options import JsonOption
from transientcam.cli.terminal import Terminal, Text, echo
from transientcam_server.cli.options import ConfigOption, HostOption, PortOption

if TYPE_CHECKING:
    from transientcam_driver import Camera
    from transientcam_server.settings import Settings

_log = logging.getLogger("transientcam_server.serve")
_OF_ONE_CAMERA: Final = ("calibration", "sequence", "sensor", "lens")
_AGAIN_S: Final = 0.1
_HANDED_OVER_S: Final = 10.0
"""The supervisor of a daemon that has ended holds the camera until its light is off, or so long."""


def serve(
    camera: Annotated[
        str | None,
        typer.Option(
            help="NAME:ADDRESS, as `transientcam devices` lists them; or none.  "
            "[default: sim:mirrors]",
            autocompletion=lambda: _camera_names(),
        ),
    ] = None,
    host: HostOption = None,
    port: PortOption = None,
    calibration: Annotated[
        Path | None,
        typer.Option(help="A file of `transientcam calibrate`.  [default: nominal gains]"),
    ] = None,
    config: ConfigOption = None,
    device: Annotated[
        str | None,
        typer.Option(help="What computes frames: cpu, gpu, gpu:NAME or auto.  [default: cpu]"),
    ] = None,
    announce: Annotated[
        bool | None,
        typer.Option(
            help="Announce it on the local network (mDNS).  [default: if other machines reach it]"
        ),
    ] = None,
    insecure: Annotated[
        bool,
        typer.Option("--insecure", help="Let any client that reaches the port control the camera."),
    ] = False,
    tls_certificate: Annotated[
        Path | None, typer.Option(help="Certificate chain in PEM: serve https and wss.")
    ] = None,
    tls_key: Annotated[
        Path | None, typer.Option(help="Its private key in PEM, where it is in another file.")
    ] = None,
    log_level: Annotated[str | None, typer.Option(help="debug, info, warning or error.")] = None,
    check: Annotated[
        bool,
        typer.Option("--check", help="Print the effective settings and their sources, then exit."),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Run the daemon: a camera on the network, with its dashboard."""
    from transientcam_server.daemon import load_settings

    command_line = {
        "camera": camera,
        "calibration": calibration,
        "host": host,
        "port": port,
        "device": device,
        "announce": None if announce is None else ("off", "on")[announce],
        "insecure": insecure or None,
        "tls_certificate": tls_certificate,
        "tls_key": tls_key,
        "log_level": log_level,
    }
    if check:
        _check(command_line, config, as_json=as_json)
        return
    settings = load_settings(command_line, file=config, environment=os.environ)
    run(settings, lambda url: print_address(url, settings.camera, as_json=as_json))


def run(settings: "Settings", on_listening: Callable[[str], None]) -> None:
    """Serve a camera, and others in its place, until a signal; ``on_listening`` gets the address.

    One that cannot be opened, or fails as it starts, is waited for.
    """
    import transientcam_moments as tm
    from transientcam_driver import CameraError
    from transientcam_server.api import build_app
    from transientcam_server.camera import NO_CAMERA, AbsentCamera, start_with
    from transientcam_server.daemon import (
        address,
        configure_logging,
        exit_without_joining,
        freeze_startup_objects,
        listen,
        serve_app,
    )

    configure_logging(settings)
    tm.kernels.use_device(settings.device)
    # the address first: if another daemon has it, the camera stays untouched
    with exit_without_joining(), listen(settings.host, settings.port) as listener:
        url = address(listener, tls=settings.tls_certificate is not None)
        tell = iter([on_listening])

        def serve_one(spec: str, opened: "Camera") -> "tuple[str, Camera] | None":
            own = settings_for(settings, spec)
            start_with(opened, own.sequence)
            app = build_app(opened, own)
            service = app.state.service
            freeze_startup_objects(service.pipeline.prepare_kernels(service.applied))

            def listening() -> None:
                next(tell, lambda url: None)(url)  # of the first camera alone
                service.planning.prepare()

            return serve_app(app, own, listener, on_listening=listening)

        none = AbsentCamera() if settings.camera == NO_CAMERA else None
        following: tuple[str, Camera | None] | None = settings.camera, none
        while following is not None:
            spec, found = following
            try:
                with found or open_after_others(spec) as opened:
                    following = serve_one(spec, opened)
            except CameraError as error:
                reason = f"{spec} cannot be opened: {error}"
                _log.warning("%s; it is waited for", reason)
                following = NO_CAMERA, AbsentCamera(reason, wanted=spec)


def settings_for(settings: "Settings", spec: str) -> "Settings":
    """Return the settings that hold for a camera: those of `_OF_ONE_CAMERA` for the first alone."""
    if spec == settings.camera:
        return settings
    defaults = type(settings)()
    own = {name: getattr(defaults, name) for name in _OF_ONE_CAMERA}
    return settings.model_copy(update={**own, "camera": spec})


def open_after_others(spec: str, *, pause: Callable[[float], None] = time.sleep) -> "Camera":
    """Open a camera; wait for another program that holds it, which may be about to end."""
    from transientcam_driver import CameraBusy, open_camera

    for _ in range(round(_HANDED_OVER_S / _AGAIN_S)):
        with suppress(CameraBusy):
            return open_camera(spec)
        pause(_AGAIN_S)
    return open_camera(spec)


def _camera_names() -> list[str]:
    from transientcam_driver import list_scenes
    from transientcam_driver.camera import kinds

    return [*kinds(), *(f"sim:{scene.name}" for scene in list_scenes())]


def _check(command_line: dict[str, Any], config: Path | None, *, as_json: bool) -> None:
    from transientcam_server.daemon import (
        load,
        mistakes_document,
        require_usable,
        to_document,
        to_toml,
    )
    from transientcam_server.errors import SettingsError

    try:
        configuration = load(command_line, file=config, environment=os.environ)
        require_usable(configuration)
    except SettingsError as error:
        if not as_json:
            raise
        mistakes = mistakes_document(error)
        echo(json.dumps({"valid": False, "mistakes": mistakes}, default=str))
        raise typer.Exit(code=1) from error
    document = to_document(configuration)
    if as_json:
        echo(json.dumps({"valid": True, "settings": document}))
        return
    for line in to_toml(document):
        echo(line)


def print_address(url: str, camera: str, *, as_json: bool) -> None:
    """Say where a camera is served, to people or to a program."""
    if as_json:
        # flushed, since the caller reads the line from a pipe
        print(json.dumps({"url": url, "camera": camera, "pid": os.getpid()}), flush=True)  # noqa: T201
        return
    console = Terminal()
    link = url, f"bold link {url}"
    line = Text.assemble(f"transientcam serves {camera} at ", link, " (Ctrl-C ends it)")
    console.print(line)
