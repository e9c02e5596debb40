"""Run ``python -m benchmarks.likelihood [--only PART] [--write]``.

TRANSIENTCAM_TEST_DATA names a folder with measured and rendered responses, without which their
tables are left out; ``--only`` does one part; ``--write`` keeps the page as docs/likelihood.md.
"""

import argparse
from collections.abc import Callable, Iterable
from pathlib import Path

from rich.console import Console

from benchmarks.common.machine import machine
from benchmarks.common.measured_scenes import data_folder
from benchmarks.common.tables import Table
from benchmarks.likelihood import captures, shapes, sparse, speed

PAGE = Path(__file__).parents[2] / "docs" / "likelihood.md"
INTRODUCTION = """# Few returns by their likelihood

The paper's estimates explain the moments exactly, noise included. `tm.likelihood` takes the noise
of the sensor as known and looks for the few returns that the moments are likely of:

```python
import transientcam_moments as tm

sensor = tm.noise.Sensor()
noise = tm.noise.moment_noise(b[0].real, sensor, calibration=gain, zeroth="low-frequency")
found = tm.likelihood(b, noise)
found.phase_rad, found.phase_std_rad  # of one to three returns, or of one with a tail
found.explained()  # whether these returns explain the moments
direct, indirect, phase_rad = found.separate()
```

In the daemon `reconstruction.estimator` is `automatic`: the likelihood, and Pisarenko's returns
until its compiled lane is ready and where the noise is not known; each frame names its
`estimator`. Over all captures of the table "All captures" the likelihood errs least, in median,
90 % and RMSE together; in some, as the composite of measured responses, maximum entropy errs less.
The product `reduced_chi_square` comes from it, unless the estimator is `two-returns` or
`unwrapped-phase`, which have one of their own; the flag `unexplained` and `predicted_range_std_m`
where it is the estimator. Elsewhere NumPy computes the same, more slowly, until the lane is ready:
no frame waits for a compiler.

A camera's moments have errors beside noise: what calibration leaves, and light of no model. The
daemon adds 0.4 % of the largest moment to the deviation (`model_error`), so that captures of many
takes are not split by them; `tm.likelihood` itself adds nothing unless it is given.

Two models are fitted: one to three sharp returns, and a return with a tail that begins with it,
whose light comes with the density of a gamma distribution. The Bayesian information criterion
chooses, with a margin that keeps noise from splitting a return. What a frame costs, how close the
errors come to the least possible ones, and what light of other shapes does is below.

The exponent p of the tail is 3, and no exponent is best for all tails: 1 suits exponential ones, 2
foam, 3 and 4 the corner and light that ends. With p = 3 exponential tails and sums of two tails
are taken to begin 30 to 60 mm late, foam 25 to 35 mm; chi-square says so only where that is more
than the noise."""


def main() -> None:
    """Measure, print, and with ``--write`` keep the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=("sparse", "captures", "shapes", "speed"))
    parser.add_argument("--write", action="store_true", help="write docs/likelihood.md")
    arguments = parser.parse_args()
    parts: dict[str, Callable[[], Iterable[Table]]] = {
        "sparse": sparse.tables,
        "captures": captures.tables,
        "shapes": lambda: shapes.tables(data_folder()),
        "speed": speed.tables,
    }
    chosen = parts if arguments.only is None else {arguments.only: parts[arguments.only]}
    console, lines = Console(width=200), [INTRODUCTION, ""]
    lines += [f"Written by `python -m benchmarks.likelihood --write` on: {machine()}.", ""]
    for make in chosen.values():
        for table in make():
            table.show(console)
            lines += [table.markdown(), ""]
    if arguments.write:
        PAGE.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")


main()
