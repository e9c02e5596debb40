"""The pass over a frame on each device of this machine, against compiled kernels."""

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

import transientcam_moments as tm
from benchmarks.common.data import CORES, PAPER, SETTINGS, VGA, images
from benchmarks.common.tables import Table, heads
from benchmarks.common.timing import measure

_ORDERS = (3, 4, 8)


def tables(software: bool = False) -> Iterator[Table]:
    """Measure frames with all that comes back; devices that compute on the processor if asked."""
    tm.kernels.compile(_ORDERS, ("float32", "float64"), names=("reconstruct", "pisarenko"))
    found = [each for each in tm.kernels.devices() if software or each.kind != "CPU"]
    for device in found:
        table = Table(
            f"{device.name} ({device.kind}, {device.backend}) and {CORES} cores",
            heads("pixels | m | cores, a frame | device, a frame | gain | phases off by 1e-3 rad"),
            notes=["A frame: raw images in, all results out, float64 redone; Pisarenko's returns."],
        )
        for shape in (PAPER, VGA):
            for m in _ORDERS:
                table.rows.append(_row(device.name, shape, m))
        yield table
    if not found:
        raise SystemExit("There is no GPU here; --software measures software devices.")


def _row(name: str, shape: tuple[int, int], m: int) -> tuple[str, ...]:
    raw = images(m, shape)
    made = {
        device: tm.Reconstructor(SETTINGS, calibration=np.ones(m + 1), device=device)
        for device in ("cpu", f"gpu:{name}")
    }
    spread = tm.kernels.over_all_cores()
    cores, device = (measure(partial(each, raw, spread=spread)) for each in made.values())
    own, other = (each(raw, spread=spread).phase_rad for each in made.values())
    off = np.mean(np.abs(np.angle(np.exp(1j * (own - other)))) > 1e-3)
    gain = cores.median_s / device.median_s
    pixels = math.prod(shape)
    return f"{pixels}", f"{m}", str(cores), str(device), f"{gain:.2f}", f"{off:.2%}"
