"""Cost against the number of pixels."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import transientcam_moments as tm
from benchmarks.common.data import CORES, images, one_pass, reconstructor
from benchmarks.common.tables import Table, heads
from benchmarks.common.timing import measure

_M = 4
_SHAPES = ((100, 100), (250, 400), (1000, 1000), (2500, 4000))


def tables() -> Iterator[Table]:
    """Measure the whole reconstruction from 1e4 to 1e7 pixels."""
    tm.kernels.compile()
    table = Table(
        f"The whole reconstruction against the number of pixels, m = {_M}, float32, {CORES} cores",
        heads("pixels | a frame | ns a pixel:.1f | pixels redone in float64:.2%"),
        notes=["Small images fit in the caches and pay for the threads; large ones for memory."],
    )
    with ThreadPoolExecutor(max(1, CORES - 1)) as executor:
        spread = tm.kernels.over(executor, CORES)
        for shape in _SHAPES:
            raw = images(_M, shape)
            made = reconstructor(_M)
            redone = one_pass(_M, shape).images(raw, None, spread).redone
            timing = measure(partial(made, raw, spread=spread), least_s=1.0)
            pixels = shape[0] * shape[1]
            each_ns = timing.median_s / pixels * 1e9
            table.rows.append((f"{pixels:.0e}", str(timing), each_ns, redone / pixels))
            del raw, made
    yield table
