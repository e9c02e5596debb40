"""Prints what a daemon makes of each mock that runs by itself: counts, bias, noise, times."""

import sys
import tempfile
from pathlib import Path

from tests.driver.cameras.free_running.measuring import MOCKS, installed, measure

FRAMES = 50
HEAD = "mock      frames   of  share  bias, mm  stated/measured  mcap off, us  checks failed"


def main() -> None:
    """Measure them one after another."""
    print(HEAD)
    with installed():
        for name in sys.argv[1:] or MOCKS:
            with tempfile.TemporaryDirectory() as directory:
                found = measure(name, Path(directory), FRAMES)
            share, ratio = found.delivered / found.produced, found.stated_mm / found.scatter_mm
            print(
                f"{name:8} {found.delivered:7} {found.produced:4} {share:6.0%} "
                f"{found.bias_mm:9.3f} {ratio:16.2f} {1e6 * found.mcap_off_s:13.3f} "
                f"{len(found.failed):14}"
            )


if __name__ == "__main__":
    main()
