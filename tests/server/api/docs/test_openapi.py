"""How the OpenAPI document is made: once, and not on the event loop."""

import asyncio
import json
import threading
from typing import Any

from fastapi import FastAPI

from transientcam_server.api._docs.openapi import Interface


def test_it_is_made_once_for_all_callers_and_not_on_the_loop() -> None:
    app = FastAPI()
    made: list[int] = []
    document: dict[str, Any] = {"paths": {"/å": {}}}

    def openapi() -> dict[str, Any]:
        made.append(threading.get_ident())
        return document

    app.openapi = openapi  # type: ignore[method-assign]  # as the service extends it
    interface = Interface(app)

    async def ask() -> bytes:
        impatient = asyncio.create_task(interface.content())
        await asyncio.sleep(0)
        impatient.cancel()  # the others wait on
        assert await interface.document() == document
        return await interface.content()

    assert json.loads(asyncio.run(ask())) == document
    assert len(made) == 1
    assert made != [threading.get_ident()]
