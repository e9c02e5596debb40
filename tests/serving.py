"""A real daemon for tests: uvicorn on a port of its own, on a thread, with a simulated camera."""

import asyncio
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any
from unittest import mock

import uvicorn.server
from fastapi import FastAPI

import transientcam
from transientcam.opening import remote_recording
from transientcam.remote_file import RemoteFile
from transientcam_compiled import ChildProcess
from transientcam_driver import Camera, open_camera
from transientcam_driver.clock import Clock
from transientcam_server import service
from transientcam_server.api import build_app
from transientcam_server.broadcast import Hub
from transientcam_server.camera import _acquisition as acquisition
from transientcam_server.daemon._server import Server, address, listen
from transientcam_server.imaging import Frame
from transientcam_server.service import Service
from transientcam_server.settings import Settings

START_S = 60.0
UNSERVED_S = 60.0
"""A laden machine does not turn the light off in tests that are about something else."""


# A camera that is to stop or to be set is read on for so long, which hundreds of tests wait for
acquisition.READ_TIMEOUT_S = 0.03  # type: ignore[misc]

# Whoever asks for the longest wait for a frame that there is waits longer in tests, and the default
# patience of a client is longer, too: a laden machine takes its time.
_PATIENT_S = 60.0
_LONGEST_WAIT_S = 10.0
_newest = Hub.newest


async def _patiently(hub: Hub, *, after: int, wait_s: float) -> Frame:
    longer_s = _PATIENT_S if wait_s == _LONGEST_WAIT_S else wait_s
    return await _newest(hub, after=after, wait_s=longer_s)


Hub.newest = _patiently  # type: ignore[assignment,method-assign]
_PATIENT: tuple[Any, ...] = (
    *(transientcam.Camera.__init__, transientcam.AsyncCamera.__init__, RemoteFile.__init__),
    *(transientcam.open, remote_recording),
)
for _each in _PATIENT:
    assert _each.__kwdefaults__["timeout_s"] < _PATIENT_S
    _each.__kwdefaults__["timeout_s"] = _PATIENT_S


class PromptServer(Server):
    """Looks every 10 ms whether it is to end and whether all has ended, uvicorn every 100 ms."""

    async def main_loop(self) -> None:
        """Serve until the end is requested."""
        while not await self.on_tick(0):
            await asyncio.sleep(0.01)


class _Prompt(ModuleType):
    """What uvicorn knows as ``asyncio``: whatever it sleeps is at most 10 ms."""

    def __getattr__(self, name: str) -> Any:
        return getattr(asyncio, name)

    @staticmethod
    async def sleep(delay_s: float) -> None:
        await asyncio.sleep(min(delay_s, 0.01))


uvicorn.server.asyncio = _Prompt("asyncio")  # type: ignore[attr-defined]


@dataclass(frozen=True, slots=True)
class Served:
    """A running daemon: where it is, and its parts for those who look inside."""

    url: str
    app: FastAPI
    camera: Camera
    settings: Settings

    @property
    def stream_url(self) -> str:
        """Address of the stream."""
        return self.url.replace("http", "ws", 1) + "/api/v1/stream"

    @property
    def service(self) -> Service:
        """Acquisition, pipeline and hub of the daemon."""
        service: Service = self.app.state.service
        return service

    def start_all_workers(self) -> None:
        """Let the executor start all its threads now, which it does one by one otherwise."""
        together = threading.Barrier(self.settings.workers)
        executor = self.service._executor
        for each in [executor.submit(together.wait) for _ in range(self.settings.workers)]:
            each.result()


@contextmanager
def serving(
    camera: str = "sim:mirrors?noise=off",
    *,
    prepare: Callable[[FastAPI], None] = lambda app: None,
    clock: Clock | None = None,
    **settings: Any,
) -> Iterator[Served]:
    """Serve a camera on an ephemeral port until the end of the block; leave nothing behind.

    Calibrations, and that the light is off, are kept where no other service has them, unless
    ``settings`` say where. Every camera captures at once, as a simulated one does.

    ``prepare`` is given the application before it starts; ``clock`` is that of a simulated camera.
    """
    with (
        open_camera(camera, clock=clock) as opened,
        TemporaryDirectory() as state,
        # nor is a camera taken for stalled that a laden machine leaves waiting for two seconds
        mock.patch.object(acquisition, "STALLED_MIN_S", _PATIENT_S),
        # nor are streams cut at the end before their clients have the reason
        mock.patch.object(service, "_CLOSING_S", _PATIENT_S),
        # nor does what plans or compiles for it stand back behind all other tests, while the daemon
        # and its clients go on
        mock.patch.dict(ChildProcess.__init__.__kwdefaults__, nice=0),
    ):
        usual: dict[str, Any] = {"port": 0, "log_level": "warning", "capture_at_start": True}
        usual |= {"calibrations": {"directory": state}}
        usual |= {"light": {"directory": f"{state}/light", "delay_s": 0.0, "unused_s": 0.0}}
        # a laden machine may take longer to ask for a frame than a service keeps it
        usual |= {"history": {"seconds": 3600.0}}
        # not the defaults, which depend on the kernels that other tests of this process have
        # compiled, and take NumPy half a second a frame; what they compute is tested by name, and
        # as served in `offline/test_by_hand.py`
        usual |= {"reconstruction": {"estimator": "pisarenko", "neighbours": "gaussian"}}
        chosen = _patient(Settings(camera=camera, **{**usual, **settings}))
        app = build_app(opened, chosen)
        prepare(app)
        with listen(chosen.host, chosen.port) as listener:
            listening = threading.Event()
            server = PromptServer(app, chosen, on_listening=listening.set)
            thread = threading.Thread(target=server.run, args=([listener],), name="served")
            thread.start()
            try:
                assert listening.wait(START_S), "the daemon did not start"
                tls = chosen.tls_certificate is not None
                yield Served(address(listener, tls=tls), app, opened, chosen)
            finally:
                server.should_exit = True
                thread.join()


def _patient(settings: Settings) -> Settings:
    """Return settings with a long limit of time without clients, unless one was chosen."""
    if "unserved_s" in settings.limits.model_fields_set:
        return settings
    limits = settings.limits.model_copy(update={"unserved_s": UNSERVED_S})
    return settings.model_copy(update={"limits": limits})
