"""The plug-in ``tofcam660``: an ESPROS TOFcam660 on the network, or its emulation."""

from collections.abc import Iterator
from contextlib import closing, suppress
from dataclasses import replace
from typing import Any, Final, get_args

from transientcam_driver.camera import Camera, CameraName, CameraPlugin, FoundCamera
from transientcam_driver.cameras import tofcam660
from transientcam_driver.cameras.triggered import TriggeredCamera
from transientcam_driver.clock import Clock
from transientcam_driver.errors import CameraError, SequenceError, SpecError
from transientcam_driver.sequence import MAX_HARMONICS, Sampling
from transientcam_simulation.emulated import build_tofcam660
from transientcam_simulation.entries.emulated import (
    EMULATED,
    OF_EMULATION,
    require_no_emulation,
    simulated_scene,
)

_LOOK_S: Final = 0.3
_EMULATED_ANSWER_S: Final = 60.0
"""An emulated camera may compute for seconds what a scene looks like at another frequency."""
_OPTIONS: Final = {
    "data": "tcp or udp: what images travel over; auto is tcp where the firmware has it",
    "region": "LEFT,TOP,RIGHT,BOTTOM: the part of the sensor that is read; TOP is 240 - BOTTOM",
    "multiples": "J,J,...: which multiples of the base frequency are measured, 1 to m without it",
    "settle_s": f"time for each change of the frequency, {tofcam660.SETTLE_S:g} s without it",
    "answer_s": "longest time for an answer",
    "image_s": "longest time for an image",
}


def device_options(name: CameraName) -> tofcam660.DeviceOptions:
    """Read how the camera of a name is used. Raises SpecError naming the part that is not valid."""
    emulated = name.address == EMULATED
    data_over: Any = name.choice("data", get_args(tofcam660.DataOver))
    return tofcam660.DeviceOptions(
        data_over=data_over,
        region=_region(name),
        multiples=_multiples(name),
        settle_s=name.number("settle_s", tofcam660.SETTLE_S, least=0.0, most=10.0),
        answer_s=name.number(
            "answer_s", _EMULATED_ANSWER_S if emulated else 1.0, least=0.01, most=600.0
        ),
        image_s=name.number("image_s", 1.0, least=0.01, most=60.0),
    )


def _region(name: CameraName) -> tofcam660.Region:
    text = name.options.get("region")
    if text is None:
        return tofcam660.FULL
    parts = text.split(",")
    if len(parts) == 4 and all(each.isascii() and each.isdigit() for each in parts):
        region = tofcam660.Region(*(int(each[:6]) for each in parts))
        if region.possible:
            return region
    limit = "LEFT,TOP,RIGHT,BOTTOM within 320 x 240 pixels, with TOP = 240 - BOTTOM"
    raise name.refused("region", limit)


def _multiples(name: CameraName) -> tuple[int, ...]:
    text = name.options.get("multiples")
    if text is None:
        return ()
    parts = text.split(",")
    if all(each.isascii() and each.isdigit() and len(each) < 4 for each in parts):
        with suppress(SequenceError):
            return Sampling(tuple(map(int, parts))).multiples
    limit = f"integers from 1 to {MAX_HARMONICS}, ascending, without a common factor: 2,3"
    raise name.refused("multiples", limit)


def _open(name: CameraName, clock: Clock) -> Camera:
    options = device_options(name)
    if name.address != EMULATED:
        _require_real(name)
        return TriggeredCamera(lambda: tofcam660.Tofcam660(name.address, options), clock=clock)
    wanted = simulated_scene(name)
    emulated, simulation = build_tofcam660(wanted.load(), seed=wanted.seed, clock=clock)
    there = replace(
        options, control_port=emulated.control_port, data_port=emulated.data_port, udp_port=0
    )

    def connect() -> tofcam660.Tofcam660:
        device = tofcam660.Tofcam660(emulated.host, there)
        emulated.udp_port = device.udp_port
        return device

    try:
        return TriggeredCamera(connect, clock=clock, simulation=simulation, on_close=emulated.close)
    except BaseException:
        emulated.close()
        raise


def _require_real(name: CameraName) -> None:
    if not name.address:
        raise SpecError(
            name.spec, f"it names no address (the factory's is {tofcam660.DEFAULT_ADDRESS})"
        )
    require_no_emulation(name)


def _check(name: CameraName) -> None:
    device_options(name)
    if name.address == EMULATED:
        simulated_scene(name).load()
    else:
        _require_real(name)


def _find() -> Iterator[FoundCamera]:
    yield FoundCamera(f"tofcam660:{EMULATED}", product="ESPROS TOFcam660", simulated=True)


def _find_on_network() -> Iterator[FoundCamera]:
    """Look at the factory's address: a TOFcam660 does not announce itself."""
    try:
        control = tofcam660.ControlConnection(
            tofcam660.DEFAULT_ADDRESS, tofcam660.CONTROL_PORT, answer_s=_LOOK_S
        )
        with closing(control):
            answer = control.exchange(tofcam660.Command.READ_CHIP)
            wafer, chip = answer.fields(tofcam660.AnswerType.CHIP, "!HH")
    except CameraError:
        return
    spec = f"tofcam660:{tofcam660.DEFAULT_ADDRESS}"
    yield FoundCamera(spec, f"{wafer}-{chip}", "ESPROS TOFcam660", tofcam660.DEFAULT_ADDRESS)


def _facts(name: CameraName) -> Iterator[tuple[str, str]]:
    """Read what the maintainer of this driver needs to know of a real camera."""
    if name.address == EMULATED:
        return
    _require_real(name)
    with closing(tofcam660.Tofcam660(name.address, device_options(name))) as device:
        yield from device.facts()


PLUGIN: Final = CameraPlugin(
    summary="an ESPROS TOFcam660 on the network, or its emulation (docs/cameras.md)",
    usage=f"tofcam660:ADDRESS or tofcam660:{EMULATED}",
    open=_open,
    find=_find,
    find_on_network=_find_on_network,
    check=_check,
    facts=_facts,
    options={**_OPTIONS, **OF_EMULATION},
)
