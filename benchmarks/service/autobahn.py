"""The WebSocket of the service against Autobahn's fuzzing client, which needs Python 2.7.

What answers is an echo behind the same classes as the service's stream, with the same limits but
for the number of messages, since an echo has no frames that they would be counted against.
"""

import asyncio
import collections
import json
import os
import socket
import subprocess
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import uvicorn

from benchmarks.common.tables import Table
from transientcam_server.daemon._acceptor import Acceptor
from transientcam_server.daemon._connections import BoundedConnection
from transientcam_server.daemon._streams import BoundedStream
from transientcam_server.settings import LimitSettings, StreamSettings

LEFT_OUT = ("9.*", "12.*", "13.*")
"""Limits and performance of large messages; compression, which is never agreed on."""
MESSAGE_BYTES = 16 * 1024**2
MESSAGES_HZ = 100_000.0
_PROGRAM = """
import site, sys
site.addsitedir(sys.argv.pop(1))  # not a mere path: one of its packages is spread over several
from autobahntestsuite.wstest import run
run()
"""
PASSED = ("OK", "NON-STRICT", "INFORMATIONAL")


async def echo(scope: Any, receive: Any, send: Any) -> None:
    """Answer every message with itself."""
    if scope["type"] != "websocket":
        return
    await receive()
    await send({"type": "websocket.accept"})
    while (message := await receive())["type"] == "websocket.receive":
        await send({**message, "type": "websocket.send"})


class Echo(uvicorn.Server):
    """uvicorn behind the service's own acceptor, through which it reads in portions."""

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Accept connections of the first socket."""
        await super().startup([])
        assert sockets
        make: Any = self.config.http_protocol_class  # the one given, by keywords
        protocol = partial(make, config=self.config, server_state=self.server_state, app_state={})
        limits = LimitSettings()
        self._acceptor = Acceptor(
            sockets[0], protocol=protocol, limits=limits, watched=lambda: False
        )
        self._acceptor.open()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Accept no more."""
        await self._acceptor.close()
        await super().shutdown(sockets)


@contextmanager
def echoing() -> Iterator[int]:
    """Serve the echo; yields its port."""
    limits = LimitSettings()
    stream = StreamSettings(max_messages_hz=MESSAGES_HZ)
    config = uvicorn.Config(
        echo,
        lifespan="off",
        http=partial(BoundedConnection, limits=limits),  # type: ignore[arg-type]
        ws=partial(BoundedStream, limits=limits, stream=stream),  # type: ignore[arg-type]
        ws_per_message_deflate=False,
        ws_max_size=MESSAGE_BYTES,
        log_config=None,
    )
    server = Echo(config)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.setblocking(False)
        serving = partial(asyncio.run, server.serve(sockets=[listener]))
        thread = threading.Thread(target=serving, daemon=True)
        thread.start()
        try:
            yield listener.getsockname()[1]
        finally:
            server.should_exit = True
            thread.join()


def measure(python: str, site: Path | None) -> dict[str, dict[str, Any]]:
    """Return what the fuzzing client says of each case."""
    with tempfile.TemporaryDirectory() as name, echoing() as port:
        directory = Path(name)
        specification = {
            "outdir": str(directory / "reports"),
            "servers": [{"agent": "transientcam", "url": f"ws://127.0.0.1:{port}"}],
            "cases": ["*"],
            "exclude-cases": list(LEFT_OUT),
            "exclude-agent-cases": {},
        }
        (directory / "fuzzingclient.json").write_text(json.dumps(specification), encoding="utf-8")
        subprocess.run(
            [
                *(python, "-c", _PROGRAM, "" if site is None else str(site.resolve())),
                *("-m", "fuzzingclient", "-s", "fuzzingclient.json"),
            ],
            cwd=directory,
            env={**os.environ, "PYTHONPATH": ""},
            stdout=subprocess.DEVNULL,
            check=True,
        )
        report = (directory / "reports" / "index.json").read_text(encoding="utf-8")
        found: dict[str, dict[str, Any]] = json.loads(report)["transientcam"]
    return found


def tables(*, python: str = "python2.7", site: Path | None = None) -> Iterator[Table]:
    """Run the client by a Python 2.7; ``site`` is where autobahntestsuite was installed."""
    found = measure(python, site)
    by_group: dict[str, collections.Counter[str]] = {}
    for case, each in found.items():
        by_group.setdefault(case.partition(".")[0], collections.Counter())[each["behavior"]] += 1
    outcomes = sorted({each["behavior"] for each in found.values()})
    rows = [
        (f"{group}.*", *(counts[each] for each in outcomes))
        for group, counts in sorted(by_group.items(), key=lambda item: int(item[0]))
    ]
    other = [
        f"- not passed: {case}: {each['behavior']}, close {each['behaviorClose']} "
        f"(code {each['remoteCloseCode']})"
        for case, each in sorted(found.items(), key=lambda item: _number(item[0]))
        if each["behavior"] not in PASSED or each["behaviorClose"] not in PASSED
    ]
    yield Table("", ("cases", *outcomes), rows, other, [f"{len(found)} cases:"])


def _number(case: str) -> tuple[int, ...]:
    return tuple(map(int, case.split(".")))
