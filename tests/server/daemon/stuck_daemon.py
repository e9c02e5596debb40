"""``transientcam serve`` with one more route, which stops the event loop until a file is opened.

``GET /stuck?fifo=PATH`` reads from a FIFO on the loop: it turns again when the other end is closed.
"""

import sys
from pathlib import Path
from typing import Any

from fastapi import FastAPI

from transientcam.cli import main
from transientcam_server.api import app as application

_build = application.build_app


def _with_route(*arguments: Any) -> FastAPI:
    app = _build(*arguments)

    @app.get("/stuck")
    async def stuck(fifo: str) -> None:
        Path(fifo).read_bytes()

    return app


if __name__ == "__main__":
    application.build_app = _with_route  # type: ignore[assignment]  # takes the same
    sys.argv[0] = "transientcam"
    main()
