"""What every test stands on: nothing may be left behind, and real data where it is at hand."""

import gc
import os
import signal
import threading
from collections.abc import Generator, Iterator
from pathlib import Path

import pytest
from httpx._config import DEFAULT_TIMEOUT_CONFIG
from hypothesis import settings

# no assertion depends on time: what hangs is ended by the limit of each test
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

ROOT = Path(__file__).resolve().parents[1]

# no process of a test compiles what it does not ask for; those that test it set it back
os.environ["TRANSIENTCAM_KERNELS"] = "manual"
# before NumPy is imported: a product of matrices would begin a thread a core in every worker, and
# these wait for each other busily, which doubles the processor time of what computes most
os.environ["OPENBLAS_NUM_THREADS"] = "1"
# JAX computes little here, and its compiler takes most of the time to make that quick
os.environ["XLA_FLAGS"] = (
    "--xla_backend_optimization_level=0 --xla_llvm_disable_expensive_passes=true"
)
# every process that a test starts would compile all modules anew, which takes it a second
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
# what starts the tests in the background has them ignore SIGINT, which every process that they
# start would inherit, and then not end by it
signal.signal(signal.SIGINT, signal.default_int_handler)
# httpx gives up after 5 s, which a laden machine may take to answer; what hangs is ended by the
# limit of each test
for _each in ("connect", "read", "write", "pool"):
    setattr(DEFAULT_TIMEOUT_CONFIG, _each, 60.0)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let a real camera take part: ``pytest tests/driver --usb=real``."""
    parser.addoption(
        "--usb",
        choices=("emulated", "real"),
        default="emulated",
        help="Run the tests of every mount with a real camera, too, which must be plugged in.",
    )


# Threads that libraries keep for the life of the process, or of the loop of a daemon that several
# tests share, by the start of their name.
_LIBRARY_THREADS = (
    "pydev",
    "OpenBLAS",
    "transientcam-compile",
    "transientcam-kernel",
    "AnyIO worker",
    "uvloop_",
    "zarr_io",
    "asyncio_",  # the executor of zarr's loop
    "requests_",  # that of a daemon's
    "disk-",  # where it waits for the disk
    "fsspecIO",
    "Dask-",
    "IO loop",
)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Half as many workers again as cores: a fifth of a test's time is spent waiting.

    What is waited for are cameras, which take their images in real time, browsers and daemons.
    """
    affinity = getattr(os, "sched_getaffinity", None)  # a container may have fewer than there are
    cores = len(affinity(0)) if affinity is not None else os.cpu_count() or 1
    return cores + max(1, cores // 2)


# Those of more than a quarter of a minute: begun last, one would keep one worker alone at the end.
_LONGEST_FIRST = (
    "tests/server/fuzzing/test_interface.py",
    "tests/browser/test_recordings.py",
    "tests/browser/test_settings.py",
    "tests/experiments/paper/test_figures.py",
    "tests/server/api/routes/test_recordings.py",
    # before all others that need what it compiles: two workers would compile it at the same time
    "tests/moments/kernels/test_kernels_compiled.py",
    "tests/simulation/light/test_compiled.py",  # the same, of simulated light
    "tests/conformance/test_conformance.py",
    "tests/stability/test_sweep.py",
    "tests/moments/noise/test_noise.py",
    "tests/server/recording/test_recovery.py",
    "tests/server/daemon/test_server.py",
    "tests/browser/test_views.py",
    "tests/browser/test_accessibility.py",
    "tests/server/fuzzing/test_recordings.py",
    "tests/moments/kernels/test_kernels_reconstruct.py",
    "tests/server/recording/test_disk.py",
    "tests/browser/test_transient.py",
    "tests/browser/test_accuracy.py",
    "tests/browser/test_large_frames.py",
    "tests/world/test_world.py",
    "tests/stability/test_density.py",
    "tests/surroundings/test_matrix.py",
    "tests/moments/kernels/test_kernels_likelihood.py",
    "tests/moments/kernels/test_kernels_peaks.py",
    "tests/moments/arrays/test_namespaces.py",
    "tests/notebooks/test_notebooks.py",
    "tests/experiments/test_commands_interrupted.py",
    "tests/server/api/routes/test_calibrations.py",
    "tests/server/planning/process/test_process.py",
    "tests/simulation/light/test_transport.py",
)


_MARKED = {
    "tests/browser": "browser",
    "tests/server/fuzzing": "fuzz",
    "tests/moments/kernels": "compiled",
    "tests/moments/arrays/test_namespaces.py": "compiled",  # by JAX
    "tests/moments/noise": "sampled",
}
_DAEMONS = {"breakable", "http", "served", "steady", "streaming", "serving", "url"}
"""Fixtures that begin a daemon, and functions that a module of tests imports for it."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests by what they need; begin with the files that take longest."""
    paths = {item.path for item in items}
    marks = {
        path: [mark for folder, mark in _MARKED.items() if path.is_relative_to(ROOT / folder)]
        for path in paths
    }
    for item in items:
        for mark in marks[item.path]:
            item.add_marker(mark)
        known = {*getattr(item, "fixturenames", ()), *vars(getattr(item, "module", object))}
        if _DAEMONS & known:
            item.add_marker("daemon")
    place = {ROOT / name: at for at, name in enumerate(_LONGEST_FIRST)}
    order = {path: place.get(path, len(place)) for path in paths}
    items.sort(key=lambda item: order[item.path])


@pytest.hookimpl(wrapper=True)
def pytest_collection(session: pytest.Session) -> Generator[None, object, object]:
    """Keep the collector from going through a million objects of modules that stay anyway."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.collect()
        gc.freeze()


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The directory of foreign measurements; tests skip where it is absent."""
    directory = Path(os.environ.get("TRANSIENTCAM_TEST_DATA", ROOT.parent / "shared" / "data"))
    if not directory.is_dir():
        pytest.skip(f"no measured data at {directory} (set TRANSIENTCAM_TEST_DATA)")
    return directory


@pytest.fixture(scope="session", autouse=True)
def data_of_its_own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep the user's recordings out of the tests' reach, and theirs out of the user's."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_DATA_HOME", str(tmp_path_factory.mktemp("data")))
        patch.delenv("STATE_DIRECTORY", raising=False)
        yield


@pytest.fixture(autouse=True)
def nothing_left_behind() -> Iterator[None]:
    """Fail the test that leaves a thread running or an open file, socket or loop uncollected."""
    before = set(threading.enumerate())
    yield
    left = [
        thread
        for thread in threading.enumerate()
        if thread not in before
        and thread.is_alive()
        and not thread.name.startswith(_LIBRARY_THREADS)
        # no Python code started it: a library's own, known here since it called something
        and not isinstance(thread, threading._DummyThread)
    ]
    for thread in left:
        thread.join(timeout=60.0)
    alive = [thread.name for thread in left if thread.is_alive()]
    assert not alive, f"threads left behind: {alive}"
    gc.collect(0)  # unclosed resources warn when collected, and warnings are errors
