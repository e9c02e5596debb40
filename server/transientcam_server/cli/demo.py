"""The verb ``demo`` of the ``transientcam`` command."""

import os
import threading
import webbrowser
from typing import Annotated

import typer

from transientcam.cli.options import JsonOption
from transientcam_server.cli.serve import print_address, run


def demo(
    scene: Annotated[
        str, typer.Argument(help="Of `transientcam scenes`, or a file of your own.")
    ] = "mirrors",
    port: Annotated[int | None, typer.Option(help="TCP port; 0 takes any free one.")] = None,
    browser: Annotated[bool, typer.Option(help="Open the dashboard in the browser.")] = True,
    as_json: JsonOption = False,
) -> None:
    """Serve a simulated camera on this machine alone, and open its dashboard."""
    from transientcam_server.daemon import load_settings

    camera = f"sim:{scene}"
    chosen = {"camera": camera, "host": "127.0.0.1", "port": port}

    def listening(url: str) -> None:
        print_address(url, camera, as_json=as_json)
        # without these a browser would take the terminal that this runs in
        if browser and {"BROWSER", "DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys():
            threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()

    run(load_settings(chosen, environment=os.environ), listening)
