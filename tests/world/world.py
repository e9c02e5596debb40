"""A world in one process: a camera, a daemon's logic, a relay, two clients, a network and a disk.

One scheduler steps all of them by one virtual clock; a seed draws what goes wrong, and when. What
runs is the product's: acquisition, light guard, lease, library, recorder, writer, recovery, what
answers the keys of Zarr, and what a relay delivers. What is modelled is what is outside of it: the
camera's hardware with its heartbeat, the network (delayed, cut, half open: a request arrives and
its answer does not), in which order HTTP has requests handled (those that switch off go first), the
disk below the calls of the system, and clients. Threads are replaced by steps, so races between
threads are not here, nor are the parser of HTTP, a relay's frames and streams.
"""

import asyncio
import heapq
import itertools
import json
import logging
import os
import random
import secrets
import shutil
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from queue import Empty
from types import SimpleNamespace
from typing import Any, Final
from unittest import mock

import numpy as np

from tests.server.recording.failing import CALLS
from tests.server.recording.made import APPLIED, CAPABILITIES, frame, header
from transientcam_driver import FrameTimeout
from transientcam_driver.errors import CameraLost
from transientcam_server.api._routes import recording_zarr
from transientcam_server.camera import Acquisition, LeaseManager, LightGuard
from transientcam_server.errors import Problem
from transientcam_server.recording import (
    Library,
    Limits,
    Recording,
    RecordingOptions,
    _layout as layout,
    recover,
    recovery,
    swmr,
)
from transientcam_server.relay._delivery import Delivery
from transientcam_server.settings import RecordingSettings

LASTS_S: Final = 6.0
TICK_S: Final = 0.1
FRAME_S: Final = 0.25
HEARTBEAT_S: Final = 2.0
LEASE_S: Final = 1.5
UNSERVED_S: Final = 1.0
REPEATED_S: Final = 20.0
"""Until a relay has repeated what did not arrive, however long its network was cut."""
OFF_WITHIN_S: Final = 0.5
"""After a lease has lapsed or safe-off was confirmed: a step of each object, and the guard's."""
GIVE_UP_S: Final = 4.0
FRAMES: Final = [frame(number) for number in range(32)]
_CHUNKS: Final = [swmr.compressed(each.images) for each in FRAMES]
_IMAGE: Final = layout.image(header(), {})


class Violation(AssertionError):  # noqa: N818 - it is no error of a program
    """Something happened that never may."""


class Clock:
    """Virtual time, and what is due."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self._due: list[tuple[float, int, Callable[[], None]]] = []
        self._order = itertools.count()

    def __call__(self) -> float:
        """Return the time."""
        return self.now_s

    def later(self, delay_s: float, call: Callable[[], None]) -> SimpleNamespace:
        """Schedule a call; the result's ``cancel`` drops it."""
        dropped: list[bool] = []
        heapq.heappush(
            self._due,
            (self.now_s + delay_s, next(self._order), lambda: None if dropped else call()),
        )
        return SimpleNamespace(cancel=lambda: dropped.append(True))

    def run(self, until_s: float) -> None:
        """Let time pass."""
        while self._due and self._due[0][0] <= until_s:
            self.now_s, _, call = heapq.heappop(self._due)
            call()
        self.now_s = until_s


class Device:
    """A camera: lit once it is started, dark when nothing was asked of it for its heartbeat."""

    capabilities, applied = CAPABILITIES, APPLIED
    factory = simulation = intrinsics = None

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._lit = False
        self._asked_s = self._read_s = clock()
        self._number = 0
        self.plugged = True

    @property
    def lit(self) -> bool:
        """Whether there is light now."""
        return self._lit and self.plugged and self._clock() - self._asked_s < HEARTBEAT_S

    def _ask(self) -> None:
        if not self.plugged:
            raise CameraLost("it is unplugged")
        if not self.lit:
            self._lit = False
        self._asked_s = self._clock()

    def start(self) -> None:
        self._ask()
        self._lit, self._read_s = True, self._clock()

    def stop(self) -> None:
        self._ask()
        self._lit = False

    def safe_off(self) -> None:
        self.stop()

    def status(self) -> Any:
        self._ask()
        return SimpleNamespace(interlock_closed=True)

    def reconnect(self) -> None:
        self.opened()

    def opened(self) -> None:
        """Be opened, by which drivers switch the light off."""
        self._ask()
        self._lit = False

    def read_frame(self, *, timeout_s: float) -> Any:
        self._ask()
        if self._clock() - self._read_s < FRAME_S:
            raise FrameTimeout(timeout_s)
        self._read_s = self._clock()
        self._number += 1
        return FRAMES[self._number % len(FRAMES)]


class Loop(asyncio.BaseEventLoop):
    """An event loop in virtual time, which has no sockets."""

    def __init__(self, clock: Clock) -> None:
        super().__init__()
        self._clock = clock
        self._selector = SimpleNamespace(select=lambda timeout: [])

    def time(self) -> float:
        return self._clock()

    def run(self, coroutine: Any) -> None:
        """Run it as time passes."""
        task = self.create_task(coroutine)
        self._clock.later(0.0, lambda: self._turn(task))

    def _turn(self, task: "asyncio.Task[None]") -> None:
        asyncio._set_running_loop(self)
        try:
            for _ in range(20):
                self._run_once()  # type: ignore[attr-defined]  # what a loop without sockets turns by
        finally:
            asyncio._set_running_loop(None)
        if not task.done():
            self._clock.later(TICK_S, lambda: self._turn(task))

    def _process_events(self, events: object) -> None:
        """Do nothing: there are none."""

    def _write_to_self(self) -> None:
        """Do nothing: it turns by itself."""


class _AtOnce:
    """Switches the light off in the place of the thread that does."""

    def __init__(self, device: Device) -> None:
        self._device = device

    def begin(self) -> "Future[None]":
        future: Future[None] = Future()
        try:
            self._device.safe_off()
            future.set_result(None)
        except CameraLost as error:
            future.set_exception(error)
        return future


class Disk:
    """What the system's calls meet: all is well, each fails, or the one that is drawn."""

    def __init__(self) -> None:
        self.fails_in: int | None = None
        self.for_ever = False
        self.error = OSError(5, "Input/output error")

    def around(self, call: Callable[..., Any]) -> Callable[..., Any]:
        def failing(descriptor: int, *arguments: Any) -> Any:
            if self.fails_in is not None:
                self.fails_in -= 1
                if self.fails_in <= 0:
                    if not self.for_ever:
                        self.fails_in = None
                    raise self.error
            return None if call.__name__ == "fsync" else call(descriptor, *arguments)

        return failing


class _Stepped:
    """In place of a thread: the scheduler does what it would do, or a loop in virtual time."""

    def __init__(self, *, target: Callable[[], None], name: str, **_: object) -> None:
        self._begin = target if name == "relay-delivery" else None

    def start(self) -> None:
        if self._begin is not None:
            self._begin()


class _Commands(list[Callable[[], None]]):
    """In place of a queue that is waited for."""

    put = list.append

    def get(self, *, timeout: float = 0.0) -> Callable[[], None]:
        if not self:
            raise Empty
        return self.pop(0)

    get_nowait = get


class Daemon:
    """The logic of the service, from a start to a death."""

    def __init__(self, world: "World") -> None:
        self._world, clock = world, world.clock
        self._light = LightGuard(unserved_s=UNSERVED_S, clock=clock)
        self.acquisition = Acquisition(
            world.device,  # type: ignore[arg-type]
            report=self._happened,
            light=self._light,
            clock=clock,
        )
        self.acquisition._commands = _Commands()  # type: ignore[assignment]
        self.acquisition._off_switch = _AtOnce(world.device)  # type: ignore[assignment]
        with suppress(CameraLost):
            world.device.opened()
        self.acquisition.set_running(False)
        self.lease = LeaseManager(
            report=self._lease_changed,
            call_later=clock.later,
            due=lambda lease: self._light.lapses_at(
                lease.expires_s if lease is not None and lease.on_lapse == "stop" else None
            ),
            clock=clock,
        )
        settings = RecordingSettings(directory=world.directory, min_free_bytes=0)
        self.library = Library(settings, header=self._header, unix_s=lambda: 1.7e9 + clock())
        recovery.recover_all(recovery.unfinished(world.directory))
        self.alive, self.served = True, True
        self._turn()

    def _header(self, recording_id: str, name: str, started_s: float) -> Any:
        return header(recording_id=recording_id, name=name, started_s=started_s)

    def _happened(self, event: Any) -> None:
        if hasattr(event, "raw"):
            self.library.offer(event.raw, event.applied)

    def _lease_changed(self, change: str, lease: Any, former: Any) -> None:
        if change == "lapsed" and lease.on_lapse == "stop":
            self.acquisition.set_running(False)

    def _turn(self) -> None:
        """Do what its threads and its loop do meanwhile."""
        if not self.alive:
            return
        self._world.clock.later(TICK_S, self._turn)
        if self.served:
            self._light.turned()
        try:
            self.acquisition._run_commands(wait_s=0.0)
            self.acquisition._step()
        except CameraLost as error:
            self.acquisition._camera_lost(str(error))
        active = self.library._active
        if active is None or active.progress.finished:
            return
        # with nothing to do it would wait
        if (active._waiting or active._work or active._reason) and not active._turn():
            active._finish()

    def die(self) -> None:
        """Be killed: nothing is written any more, and the system releases what it had."""
        self.alive = False
        active = self.library._active
        if active is not None and not active.progress.finished:
            writer = active._writer
            writer._rows._disk.error = OSError(5, "the process is dead")
            writer._rows._file.close()
            writer._rows._disk.close()
            writer._lock.close()
        self.lease.close()


@dataclass
class Request:
    """One that a client sent; it ends by an answer, or because the client gives up."""

    answered: Callable[[Any], None]
    ended: bool = False

    def end(self, answer: Any) -> None:
        """Take the first answer."""
        if not self.ended:
            self.ended = True
            self.answered(answer)


@dataclass
class World:
    """All of it, of one seed."""

    seed: int
    directory: Path
    counted: dict[str, int] = field(default_factory=dict)
    deleted: set[str] = field(default_factory=set)
    happened: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self.draw = random.Random(self.seed)
        self.clock = Clock()
        self.device = Device(self.clock)
        self.disk = Disk()
        self.cut_until_s = 0.0
        self.half_open_until_s = 0.0
        self.open = 0
        self.dark_since_s: float | None = self.clock()
        self._dead_since_s: float | None = None
        self._unserved_since_s: float | None = None
        self._switched_off_s = 0.0
        self._arrived_s, self._offs = 0.0, 0
        self.loop = Loop(self.clock)
        self.relay = Delivery(self._relayed)
        self._lease_id: str | None = None
        self._holds_until_s = 0.0

    # -- life ------------------------------------------------------------------------------------

    def run(self) -> Counter[str]:
        """Let it run, and return what happened how often.

        Raises
        ------
        Violation
            With the seed.
        """
        try:
            with self._around():
                self.daemon = Daemon(self)
                for act in (self._operate, self._read, self._go_wrong, self._check_light):
                    self._again(0.0, act)
                self.clock.run(self.clock() + LASTS_S)
                self._end()
        except Violation:
            raise
        except Exception as error:
            raise Violation(f"seed {self.seed}: {error!r}") from error
        return self.happened

    @contextmanager
    def _around(self) -> Iterator[None]:
        ids = itertools.count()
        with ExitStack() as patched:
            calls: dict[str, Any] = {name: self.disk.around(getattr(os, name)) for name in CALLS}
            for patch in (
                mock.patch.multiple(os, **calls),
                mock.patch.object(layout, "image", return_value=_IMAGE),
                mock.patch.object(threading, "Thread", _Stepped),
                mock.patch.object(asyncio, "run", self.loop.run),
                mock.patch.object(
                    secrets, "token_hex", side_effect=(f"{each:06x}" for each in ids)
                ),
            ):
                patched.enter_context(patch)
            yield

    def _end(self) -> None:
        """Restart on a disk that works, and hold what is there against what was said."""
        self.clock.run(self.clock() + GIVE_UP_S)
        if self.relay.unconfirmed:
            self.clock.run(self.clock() + REPEATED_S)
        if self.relay.unconfirmed:
            self._fail("a relay's safe-off never came to the daemon")
        if self.open:  # what the relay repeated meanwhile
            self.clock.run(self.clock() + GIVE_UP_S)
        self.loop.close()
        if self.open:
            self._fail(f"{self.open} requests did not end")
        self.disk.fails_in = None
        self.daemon.die()
        for part in recovery.unfinished(self.directory):
            recover(part)
        for recording_id, counted in self.counted.items():
            if recording_id in self.deleted:
                continue
            with Recording(self.directory / f"{recording_id}.h5") as kept:
                if kept.frames < counted:
                    self._fail(f"{recording_id} has {kept.frames} of {counted} counted frames")
                for raw in kept:
                    if not np.array_equal(raw.images, FRAMES[raw.number].images):
                        self._fail(f"{recording_id} has another frame {raw.number}")

    def _fail(self, what: str) -> None:
        raise Violation(f"seed {self.seed}, at {self.clock() - 100.0:.1f} s: {what}")

    def _again(self, delay_s: float, act: Callable[[], None]) -> None:
        """Let something act after a while, unless it is over then."""
        if self.clock() + delay_s < 100.0 + LASTS_S:
            self.clock.later(delay_s, act)

    # -- what goes wrong -------------------------------------------------------------------------

    def _go_wrong(self) -> None:
        draw, now_s = self.draw, self.clock()
        self._again(draw.uniform(0.3, 2.0), self._go_wrong)
        what = draw.choice(
            (
                "cut",
                "half open",
                "disk",
                "disk",
                "restart",
                "unplug",
                "unserved",
                "delete",
                "healed",
            )
        )
        self.happened[what] += 1
        if what == "cut":
            self.cut_until_s = now_s + draw.uniform(0.1, 3.0)
        elif what == "half open":
            self.half_open_until_s = now_s + draw.uniform(0.1, 3.0)
        elif what == "disk":
            self.disk.fails_in, self.disk.for_ever = draw.randrange(1, 80), draw.random() < 0.5
            number = draw.choice((5, 28))
            self.disk.error = OSError(number, os.strerror(number))
        elif what == "healed":
            self.disk.fails_in = None
        elif what == "restart" and self.daemon.alive:
            self.daemon.die()
            self._dead_since_s, self.dark_since_s = now_s, None
            self.clock.later(draw.uniform(0.0, 4.0), self._start)
        elif what == "unplug":
            self.device.plugged = False
            self.clock.later(draw.uniform(0.1, 2.0), self._plug)
        elif what == "unserved":
            self.daemon.served = False
            self._unserved_since_s = self._unserved_since_s or now_s
            self.clock.later(draw.uniform(0.1, 3.0), self._serve)
        elif what == "delete":  # behind the daemon's back
            path = draw.choice([*sorted(self.directory.glob("*.h5*")), None])
            if path is not None:
                self.deleted.add(path.name.partition(".")[0])
                path.unlink()

    def _start(self) -> None:
        self.disk.fails_in = None  # or it could not even recover
        self.daemon, self._dead_since_s = Daemon(self), None
        self.dark_since_s, self._unserved_since_s = self.clock(), None

    def _plug(self) -> None:
        self.device.plugged = True
        self.device._lit = False

    def _serve(self) -> None:
        self.daemon.served, self._unserved_since_s = True, None

    # -- the network -----------------------------------------------------------------------------

    def _ask(
        self,
        name: str,
        work: Callable[[Daemon], Any],
        answered: Callable[[Any], None],
        *,
        first: bool = False,
    ) -> None:
        """Send a request; what the client gets is a result, a Problem, or None if it gave up.

        One that goes ``first`` is handled as soon as it arrives, others when it is their turn.
        """
        self.open += 1
        self.happened[name] += 1

        def ended(answer: Any) -> None:
            self.open -= 1
            if isinstance(answer, Problem):
                self.happened[str(answer.kind.status)] += 1
            answered(answer)

        request = Request(ended)
        self.clock.later(GIVE_UP_S, lambda: request.end(None))
        self.clock.later(self.draw.uniform(0.0, 0.5), lambda: self._arrive(work, request, first))

    def _arrive(self, work: Callable[[Daemon], Any], request: Request, first: bool) -> None:
        daemon, now_s = self.daemon, self.clock()
        if now_s < self.cut_until_s or not daemon.alive or not daemon.served:
            return
        offs = daemon.acquisition.offs

        def handle() -> None:
            if daemon.alive and daemon.served:
                self._arrived_s, self._offs = now_s, offs
                self._handle(daemon, work, request)

        self.clock.later(0.0 if first else self.draw.uniform(0.0, 0.4), handle)

    def _handle(self, daemon: Daemon, work: Callable[[Daemon], Any], request: Request) -> None:
        try:
            answer = work(daemon)
        except Problem as problem:
            if problem.kind.status == 500:
                self._fail("an answer is 500")
            answer = problem
        if self.clock() >= self.half_open_until_s:
            self.clock.later(self.draw.uniform(0.0, 0.5), lambda: request.end(answer))

    # -- the operator ----------------------------------------------------------------------------

    def _operate(self) -> None:
        """Hold the lease, and do one thing after another."""
        self._again(self.draw.uniform(0.2, 0.6), self._operate)
        self._lease()
        chosen = self.draw.choice(
            ("light", "light", "light", "record", "look", "stop", "off", "delete")
        )
        getattr(self, f"_{chosen}")()

    def _lease(self) -> None:
        def grant(daemon: Daemon) -> Any:
            if self._lease_id is not None and daemon.lease.current is not None:
                lease = daemon.lease.renew(self._lease_id, duration_s=None, on_lapse=None)
            else:
                lease = daemon.lease.grant(
                    holder="operator",
                    by="operator",
                    rank=1,
                    duration_s=LEASE_S,
                    on_lapse="stop",
                    takeover=True,
                )
            self._lease_id, self._holds_until_s = lease.id, self.clock() + LEASE_S
            return lease.id

        self._ask("lease", grant, lambda answer: None)

    def _light(self) -> None:
        def start(daemon: Daemon) -> None:
            if daemon.lease.current is not None:
                daemon.acquisition.set_running(True, offs=self._offs)
                if self._arrived_s > self._switched_off_s:
                    self.dark_since_s = None
                else:
                    self.happened["overtaken"] += 1

        self._ask("light", start, lambda answer: None)

    def _off(self) -> None:
        if self.draw.random() < 0.5:
            self._ask("safe-off", self._switch_off, lambda answer: None, first=True)
        else:
            self.relay.begin()

    def _switch_off(self, daemon: Daemon) -> bool:
        daemon.acquisition.safe_off()
        self.dark_since_s = self._switched_off_s = self.clock()
        return True

    async def _relayed(self) -> None:
        """Send a safe-off on from the relay."""
        answer: asyncio.Future[Any] = self.loop.create_future()
        took = lambda found: None if answer.done() else answer.set_result(found)  # noqa: E731
        self._ask("relayed safe-off", self._switch_off, took, first=True)
        if await answer is None:
            raise CameraLost("no answer")

    def _record(self) -> None:
        frames = self.draw.choice((None, 1, 5))
        options = RecordingOptions(limits=Limits(frames=frames))
        self._ask("record", lambda daemon: daemon.library.start(options), self._count)

    def _look_at(self, work: Callable[[Daemon, str], Any], name: str) -> None:
        if self.counted:
            chosen = self.draw.choice(sorted(self.counted))
            self._ask(name, lambda daemon: work(daemon, chosen), self._count)

    def _stop(self) -> None:
        def stop(daemon: Daemon, recording_id: str) -> Any:
            active = daemon.library._recorder_of(recording_id)
            if active is not None:
                active.stop()
            return daemon.library.describe(recording_id)

        self._look_at(stop, "stop")

    def _look(self) -> None:
        self._ask("list", lambda daemon: daemon.library.describe_all(), self._count_all)

    def _delete(self) -> None:
        if self.counted and self.draw.random() < 0.3:
            chosen = self.draw.choice(sorted(self.counted))

            def delete(daemon: Daemon) -> None:
                self.deleted.add(chosen)  # also where its directory then cannot be brought to disk
                daemon.library.delete(chosen)

            self._ask("delete", delete, lambda answer: None)

    def _count_all(self, answer: Any) -> None:
        for each in answer if isinstance(answer, list) else ():
            self._count(each)

    def _count(self, answer: Any) -> None:
        """Believe what the daemon says of a recording."""
        if isinstance(answer, dict):
            known = self.counted.get(answer["id"], 0)
            self.counted[answer["id"]] = max(known, answer["frames"])
            synced = answer["synced_frames"]
            if synced is not None and synced > answer["frames"]:
                self._fail(f"{synced} of {answer['frames']} frames are on the disk")

    # -- the reader ------------------------------------------------------------------------------

    def _read(self) -> None:
        """Open a recording as Zarr's readers do, and read some of its frames after a while."""
        self._again(self.draw.uniform(0.5, 2.0), self._read)
        if not self.counted:
            return
        chosen = self.draw.choice(sorted(self.counted))
        self._ask(
            "open", self._key(chosen, ".zmetadata"), lambda answer: self._opened(chosen, answer)
        )

    def _key(self, recording_id: str, key: str) -> Callable[[Daemon], Any]:
        return lambda daemon: recording_zarr._read(lambda: daemon.library.find(recording_id), key)[
            0
        ]

    def _opened(self, recording_id: str, answer: Any) -> None:
        if not isinstance(answer, bytes):
            return
        frames = json.loads(answer)["metadata"]["raw/.zarray"]["shape"][0]
        for index in self.draw.sample(range(frames), min(2, frames)):
            key = self._key(recording_id, f"raw/{index}.0.0.0")
            self._again(
                self.draw.uniform(0.0, 2.0), partial(self._ask, "chunk", key, self._received)
            )

    def _received(self, answer: Any) -> None:
        if isinstance(answer, Problem) and answer.kind.status == 404:
            self._fail("a reader takes a chunk for zeros")
        if isinstance(answer, bytes) and answer not in _CHUNKS:
            self._fail("a reader gets what was not recorded")

    # -- the light -------------------------------------------------------------------------------

    def _check_light(self) -> None:
        """Require it to be off where it has to be."""
        now_s = self.clock()
        self._again(0.3, self._check_light)
        # a daemon that is dead serves nobody either: then it is the device's heartbeat
        since_s = self._unserved_since_s if self._dead_since_s is None else None
        if since_s is not None and now_s - since_s > UNSERVED_S + OFF_WITHIN_S:
            self.dark_since_s = self.dark_since_s or now_s  # until somebody starts
        if not self.device.lit:
            return
        if self._dead_since_s is not None and now_s - self._dead_since_s > HEARTBEAT_S:
            self._fail("it is lit although nobody drives the camera")
        if self.dark_since_s is not None and now_s - self.dark_since_s > OFF_WITHIN_S:
            self._fail("it is lit after safe-off")
        if self._dead_since_s is None and now_s - self._holds_until_s > OFF_WITHIN_S:
            self._fail("it is lit after its lease lapsed")


def tried(seed: int, directory: Path) -> Counter[str]:
    """Run the world of a seed in an empty directory, which it leaves empty."""
    directory.mkdir()
    try:
        return World(seed, directory).run()
    finally:
        shutil.rmtree(directory)


def tried_all(seeds: range) -> tuple[Counter[str], list[str]]:
    """Run the worlds of some seeds; return what happened how often, and the violations."""
    happened, violations = Counter[str](), []
    logging.disable()
    try:
        with tempfile.TemporaryDirectory() as place:
            for seed in seeds:
                try:
                    happened += tried(seed, Path(place) / "recordings")
                except Violation as violation:
                    violations.append(str(violation))
    finally:
        logging.disable(logging.NOTSET)
    return happened, violations
