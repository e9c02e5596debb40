"""One figure of the paper, made here or by a worker of a cluster."""

import time
from functools import lru_cache
from pathlib import Path
from typing import Any

import transientcam_moments as tm
from transientcam_experiments.paper import FIGURES, style
from transientcam_experiments.paper.bench import Bench
from transientcam_experiments.paper.page import document_of
from transientcam_server.offline import require_versions


def made(number: int, bench: Bench) -> tuple[dict[str, Any], bytes]:
    """Return the document of a figure, and its picture as PNG."""
    figure = FIGURES[number]
    begin_s = time.process_time()  # independent of other load on the machine
    result = figure.make(bench)
    picture = style.png(result.picture)
    seconds = time.process_time() - begin_s
    document = document_of(figure, result, seconds=seconds, quick=bench.quick, seed=bench.seed)
    return document, picture


def made_by_worker(
    number: int,
    seed: int,
    quick: bool,
    waveform: Path | None,
    versions: tuple[tuple[str, str], ...],
) -> tuple[dict[str, Any], bytes]:
    """Return the same of a bench that this process keeps: what a task is.

    Raises MixedVersions if this process computes with other versions than the one that asks.
    """
    require_versions(versions)
    tm.kernels.use_one_thread()  # a worker has a process, or a thread, for every core
    return made(number, _bench(seed, quick, waveform))


@lru_cache(maxsize=1)
def _bench(seed: int, quick: bool, waveform: Path | None) -> Bench:
    return Bench(seed=seed, quick=quick, waveform=waveform)
