"""``transientcam serve`` with one more route, which stops the event loop until a file is opened.

``GET /stuck?fifo=PATH`` reads from a FIFO on the loop: it turns again when the other end is closed.
"""

import sys
from pathlib import Path

from fastapi import FastAPI

from transientcam.cli import main
from transientcam_driver import Camera
from transientcam_server.api import _app as application
from transientcam_server.settings import Settings

_build = application.build_app


def _with_route(camera: Camera, settings: Settings) -> FastAPI:
    app = _build(camera, settings)

    @app.get("/stuck")
    async def stuck(fifo: str) -> None:
        Path(fifo).read_bytes()

    return app


if __name__ == "__main__":
    application.build_app = _with_route
    sys.argv[0] = "transientcam"
    main()
