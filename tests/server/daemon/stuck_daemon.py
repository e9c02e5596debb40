"""``transientcam serve`` with more routes, by which threads wait until a file is closed.

``GET /stuck?fifo=PATH`` reads from a FIFO on the event loop, ``/stuck-camera`` on the thread of the
camera, and ``/stuck-threads`` on all that requests have, as a disk does that does not answer. The
process for plans, which takes half a second of processor time, starts by ``GET /prepare``.
"""

import asyncio
import os
import sys
from pathlib import Path

from fastapi import FastAPI

from transientcam.cli import main
from transientcam_driver import Camera
from transientcam_server.api import _app as application
from transientcam_server.settings import Settings

_build = application.build_app


def _with_routes(camera: Camera, settings: Settings) -> FastAPI:
    app = _build(camera, settings)
    planning = app.state.service.planning
    prepare, planning.prepare = planning.prepare, lambda: None

    @app.get("/prepare")
    async def prepared() -> None:
        prepare()

    @app.get("/stuck")
    async def stuck(fifo: str) -> None:
        Path(fifo).read_bytes()

    @app.get("/stuck-camera")
    async def stuck_camera(fifo: str) -> None:
        app.state.service.acquisition.submit(Path(fifo).read_bytes)

    @app.get("/stuck-threads")
    async def stuck_threads(fifo: str) -> None:
        for _ in range(min(32, (os.cpu_count() or 1) + 4)):  # of a ThreadPoolExecutor
            asyncio.get_running_loop().run_in_executor(None, Path(fifo).read_bytes)

    return app


def run() -> None:
    """Run the command line's verb with these routes."""
    application.build_app = _with_routes
    sys.argv[0] = "transientcam"
    main()


if __name__ == "__main__":
    run()
