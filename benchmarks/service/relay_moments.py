"""Bytes of a frame on the way to a relay.

A relay of images and one of moments behind the same origin, with several takes: what travels to
each, and whether the range that the relay of moments computes is the origin's. None of it depends
on how fast the machine is.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from websockets.sync.client import connect
from websockets.typing import Subprotocol

import transientcam
from benchmarks.common.daemon import Process, daemon
from benchmarks.common.tables import Cell, Table, heads
from transientcam import wire
from transientcam_server.relay._frames import MOMENTS, RAW, SUBSCRIBED

SCENE: Final = "sim:corner"
HARMONICS: Final = 3
TAKES: Final = (1, 4, 12)
PISARENKO: Final = {"estimator": "pisarenko"}
"""Of relay and origin: the one estimator that is the same before and after it is compiled."""
COMPARED: Final = 3
_WAIT_S: Final = 10.0
_ASK_EVERY_S: Final = 0.05


@dataclass(frozen=True)
class Relayed:
    """What travels with one number of takes, and how far off the ranges of a relay are."""

    takes: int
    images: int
    frame_rate_hz: float
    frame_bytes: dict[str, int]
    """Of each product that can be relayed."""
    apart_m: float
    """Largest difference of a range of the relay of moments from the origin's; NaN where only one
    of the two has any."""
    equal: bool
    """Whether they are equal to the bit."""


def bytes_of_a_frame(origin: Process, product: str) -> int:
    """Return the bytes of the messages that a relay is sent for a frame."""
    products = SUBSCRIBED[product]
    subscriptions = tuple(map(wire.Subscription, products))
    sizes: dict[str, int] = {}
    protocols = [Subprotocol(wire.SUBPROTOCOL)]
    with connect(origin.stream_url, subprotocols=protocols, max_size=None) as stream:
        stream.send(wire.encode(wire.Subscribe(subscriptions)))
        while len(sizes) < len(products):
            data = stream.recv(timeout=_WAIT_S)
            message = wire.parse_server_message(data)
            if isinstance(message, transientcam.Frame):
                sizes[message.product] = len(data)
    return sum(sizes.values())


def differences(
    origin: transientcam.Camera, relay: transientcam.Camera, takes: int
) -> tuple[float, bool]:
    """Return the largest difference of the newest ranges of both in m, and whether there is any."""
    apart_m, equal = 0.0, True
    after = None
    for _ in range(COMPARED):
        ours = relay.frame("range", wait_s=_WAIT_S, after=after)
        assert ours.meta["takes"] == takes
        after = ours.frame
        its = origin.frame("range", number=_same(origin, ours.meta["device_time_s"])).array
        both = np.isfinite(its) == np.isfinite(ours.array)
        apart_m = max(apart_m, float(np.nanmax(np.abs(its - ours.array)) if both.all() else np.nan))
        equal = equal and its.tobytes() == ours.array.tobytes()
    return apart_m, equal


def _same(origin: transientcam.Camera, device_time_s: float) -> int:
    """Return the number at the origin of the frame that was captured then."""
    kept = origin.info["history"]
    for number in range(kept["last"], kept["first"] - 1, -1):
        if origin.meta(number=number)["device_time_s"] == device_time_s:
            return number
    raise LookupError(f"the origin does not keep the frame of {device_time_s} s any more")


def relayed(origin: Process, takes: int) -> Relayed:
    """Measure one number of takes."""
    with transientcam.Camera(origin.url) as camera:
        sequence = camera.configure(harmonics=HARMONICS, zeroth="low-frequency", takes=takes)
        camera.reconstruction = PISARENKO
        with (
            daemon("--camera", f"relay:{origin.url}?product={MOMENTS}") as process,
            transientcam.Camera(process.url) as relay,
        ):
            relay.reconstruction = PISARENKO
            while relay.latest(wait_s=_WAIT_S)["takes"] != takes:
                time.sleep(_ASK_EVERY_S)
            apart_m, equal = differences(camera, relay, takes)
    frame_bytes = {product: bytes_of_a_frame(origin, product) for product in SUBSCRIBED}
    rate_hz = sequence["frame_rate_hz"]
    return Relayed(takes, sequence["images"], rate_hz, frame_bytes, apart_m, equal)


def tables() -> Iterator[Table]:
    """Relay a scene with several numbers of takes."""
    with daemon("--camera", SCENE) as origin:
        rows = [_row(relayed(origin, takes)) for takes in TAKES]
    columns = heads(
        f"takes | images | `{RAW}`, bytes a frame:,.0f | `{MOMENTS}`, bytes a frame:,.0f | "
        f"share:.0% | `{RAW}`, MB/s:.2f | `{MOMENTS}`, MB/s:.2f | range at the relay"
    )
    text = (
        f"What travels to a relay of `{SCENE}`, m = {HARMONICS}, with a zeroth moment of "
        f"low-frequency images, in messages with their metadata; and the range of {COMPARED} "
        "frames at relay and origin, both by Pisarenko's returns."
    )
    yield Table("", columns, rows, text=[text])


def _row(each: Relayed) -> tuple[Cell, ...]:
    raw, moments = each.frame_bytes[RAW], each.frame_bytes[MOMENTS]
    same = "the origin's to the bit" if each.equal else f"at most {each.apart_m:.1e} m off"
    rates = (1e-6 * each.frame_rate_hz * value for value in (raw, moments))
    return (each.takes, each.images, raw, moments, moments / raw, *rates, same)
