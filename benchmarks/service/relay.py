"""A tree of relays beside viewers at the origin.

One origin, four relays and their viewers, each daemon a process of its own, all on this machine:
what the origin spends on viewers behind relays and on the same viewers directly, what a relay adds
to the way of a frame, and what viewers see when a relay is killed.
"""

import socket
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Final

import transientcam
from benchmarks.common.daemon import Process, daemon
from benchmarks.common.tables import Cell, Table, heads, percentiles
from benchmarks.service.viewers import RANGE, Viewer, beside, cut, spending, watch

RELAYS: Final = 4
VIDEO: Final = {"harmonics": 3, "zeroth": "estimated", "exposure_s": 5e-4}
SETTLE_S: Final = 4.0
BACK_WITHIN_S: Final = 30.0


@dataclass(frozen=True)
class Killed:
    """A relay was killed and started again: when its viewer had frames, and what others missed."""

    back_s: float
    others: int
    missing: int


def free_port() -> int:
    """Return a port that is free now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def relay_on(port: int, origin: Process, running: ExitStack) -> Process:
    """Start a relay that ends with ``running``."""
    options = ("--camera", f"relay:{origin.url}", "--port", str(port))
    return running.enter_context(daemon(*options))


def viewers_of(process: Process, count: int) -> list[Viewer]:
    """Return viewers of range."""
    return [Viewer(process.stream_url, RANGE) for _ in range(count)]


def observe(
    what: str, process: Process, viewers: list[Viewer], *, duration_s: float
) -> tuple[Cell, ...]:
    """Return what a daemon spends while all viewers look, and how old frames are for them."""
    watch(viewers, duration_s=SETTLE_S)
    elapsed_s, spent_s = spending(process, viewers, duration_s=duration_s)
    latencies = _percentiles([latency_s for each in viewers for latency_s in each.seen.latencies_s])
    held_mib = process.resident_bytes() / 2**20
    return what, len(viewers), spent_s / elapsed_s, held_mib, latencies


def hop_latencies(url: str, *, frames: int) -> list[float]:
    """Return what the first relay added to each of some frames."""
    with transientcam.Camera(url) as camera, camera.stream("raw") as stream:
        return [stream.receive(timeout_s=30.0).meta["hops"][0]["latency_s"] for _ in range(frames)]


def kill_one(
    origin: Process, relays: list[Process], ports: Sequence[int], running: ExitStack
) -> Killed:
    """Kill a relay, start it again on its port, and watch its viewer and those of the others."""
    others = [viewer for relay in relays[1:] for viewer in viewers_of(relay, 1)]
    others += viewers_of(origin, 1)
    reconnect = transientcam.Reconnect(first_wait_s=0.1, longest_wait_s=0.5)

    def read(ended: threading.Event) -> None:
        while not ended.is_set():
            watch(others, duration_s=0.2)

    with (
        beside(read),
        transientcam.Camera(relays[0].url) as camera,
        camera.stream("range", reconnect=reconnect) as stream,
    ):
        stream.receive(timeout_s=BACK_WITHIN_S)
        relays[0].kill()
        killed_s = time.perf_counter()
        relay_on(ports[0], origin, running)
        while "reconnected" not in [each.kind for each in stream.notices]:
            stream.receive(timeout_s=BACK_WITHIN_S)
        back_s = time.perf_counter() - killed_s
    missing = sum(each.seen.missing for each in others)
    cut(each.connection for each in others)
    return Killed(back_s, len(others), missing)


def measure(
    viewers: int, *, duration_s: float
) -> tuple[list[tuple[Cell, ...]], list[float], Killed]:
    """Measure everything, the origin with the same camera each time."""
    spent = []
    with daemon("--camera", "sim:mirrors") as origin, transientcam.Camera(origin.url) as camera:
        camera.configure(**VIDEO)
        camera.frame("range", wait_s=10.0)
        first = viewers_of(origin, 1)
        spent.append(observe("one viewer at the origin", origin, first, duration_s=duration_s))
        direct = first + viewers_of(origin, RELAYS * viewers - 1)
        spent.append(observe("all at the origin", origin, direct, duration_s=duration_s))
        cut(each.connection for each in direct)
        ports = [free_port() for _ in range(RELAYS)]
        with ExitStack() as running:
            relays = [relay_on(port, origin, running) for port in ports]
            watch([], duration_s=SETTLE_S)
            spent.append(observe("four relays without viewers", origin, [], duration_s=duration_s))
            behind = [each for relay in relays for each in viewers_of(relay, viewers)]
            spent.append(observe("all behind four relays", origin, behind, duration_s=duration_s))
            added_s = hop_latencies(relays[0].url, frames=round(10 * duration_s))
            cut(each.connection for each in behind)
            killed = kill_one(origin, relays, ports, running)
    return spent, added_s, killed


def tables(*, viewers: int = 50, seconds: float = 20.0) -> Iterator[Table]:
    """Measure with so many viewers of each relay, each case for so many seconds."""
    spent, added_s, killed = measure(viewers, duration_s=seconds)
    columns = heads(
        "viewers | of them | origin's share of one core:.0% | origin's memory, MiB:.0f | "
        "age of a frame at the viewer, 50 / 99 %, ms"
    )
    notes = [
        f"- A relay adds {_percentiles(added_s)} ms (50 / 99 %) to the way of a frame, from its "
        f"arrival at the origin to its arrival at the relay; {len(added_s)} frames.",
        "- A relay that was killed (SIGKILL) and started again had its viewer back after "
        f"{killed.back_s:.1f} s, by itself.",
        f"- {killed.others} viewers elsewhere in the tree missed {killed.missing} frames "
        "meanwhile.",
    ]
    yield Table("", columns, spent, notes)


def _percentiles(values_s: Sequence[float]) -> str:
    return percentiles([1e3 * value_s for value_s in values_s], (50, 99))
