"""Recorded bytes, and a daemon of a few lines that replays them."""

import json
import re
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import pytest
from websockets.sync.server import Server, ServerConnection, serve

from transientcam.documents import FrameMeta

SPECIFICATION = Path(__file__).resolve().parents[2] / "docs" / "stream.md"
_BLOCK = re.compile(r"```(hex|json) (\w+)\n(.*?)```", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Recording:
    """A message of docs/stream.md: its bytes, and what they say."""

    data: bytes
    document: dict[str, Any]


@pytest.fixture(scope="session")
def recorded() -> dict[str, Recording]:
    """Every message that docs/stream.md shows, by name."""
    blocks: dict[str, dict[str, str]] = {}
    for kind, name, text in _BLOCK.findall(SPECIFICATION.read_text("utf-8")):
        blocks.setdefault(name, {})[kind] = text
    return {
        name: Recording(bytes.fromhex(block["hex"]), json.loads(block["json"]))
        for name, block in blocks.items()
    }


def frame_meta(**known: object) -> FrameMeta:
    """Return the metadata of a frame, as far as a test needs it."""
    return cast("FrameMeta", known)


Handler = Callable[[ServerConnection], None]
Replay = Callable[[Handler], "ReplayServer"]


class ReplayServer:
    """A WebSocket server that runs ``handler`` for each client."""

    def __init__(self, handler: Handler, *, port: int = 0, **options: Any) -> None:
        self.connections = 0
        self._handler = handler
        options.setdefault("subprotocols", ["transientcam.v1.msgpack"])
        self._server: Server = serve(
            self._handle, "127.0.0.1", port, compression=None, max_size=2**16, **options
        )
        self.port = int(self._server.socket.getsockname()[1])
        self._thread = threading.Thread(target=self._server.serve_forever, name="replay")
        self._thread.start()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def close(self) -> None:
        self._server.shutdown()
        self._thread.join()

    def _handle(self, connection: ServerConnection) -> None:
        self.connections += 1
        self._handler(connection)


@pytest.fixture
def replay() -> Iterator[Callable[..., ReplayServer]]:
    """Start servers that are stopped after the test."""
    servers: list[ReplayServer] = []

    def start(handler: Handler, **options: Any) -> ReplayServer:
        server = ReplayServer(handler, **options)
        servers.append(server)
        return server

    yield start
    for server in servers:
        server.close()
