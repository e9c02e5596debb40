"""Runs worlds by seed on all cores: ``python -m tests.world --seeds 100000``."""

import argparse
import multiprocessing
import os
import sys
from collections import Counter

from tests.world.world import tried_all


def main() -> int:
    """Run them; 1 if one shows a violation."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seeds", type=int, default=1000)
    options.add_argument("--first", type=int, default=0)
    options.add_argument("--processes", type=int, default=os.cpu_count())
    chosen = options.parse_args()
    last = chosen.first + chosen.seeds
    parts = [range(first, min(first + 50, last)) for first in range(chosen.first, last, 50)]
    happened, violations = Counter[str](), list[str]()
    with multiprocessing.get_context("spawn").Pool(chosen.processes) as pool:
        for some, found in pool.imap_unordered(tried_all, parts):
            happened += some
            violations += found
    counts = dict(sorted(happened.items()))
    lines = [f"{chosen.seeds} seeds, {len(violations)} violations; {counts}", *violations[:20]]
    sys.stdout.write("\n".join(lines) + "\n")
    return bool(violations)


if __name__ == "__main__":
    sys.exit(main())
