"""What runs where: client and moments need nothing that only Linux or POSIX has."""

import subprocess
import sys

import pytest

from tests.serving import serving

WITHOUT_LINUX = """
import importlib, importlib.abc, os, pkgutil, signal, sys

ABSENT = {"fcntl", "termios", "resource", "pwd", "grp", "syslog", "pty", "tty", "numba"}

class Refuse(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ABSENT:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

for name in ABSENT & set(sys.modules):
    del sys.modules[name]
sys.meta_path.insert(0, Refuse())
for name in ("sched_getaffinity", "register_at_fork", "fork", "getuid", "geteuid", "sendfile"):
    if hasattr(os, name):
        delattr(os, name)
for name in ("SIGKILL", "SIGHUP", "SIGUSR1", "SIGUSR2", "SIGALRM", "SIGCHLD", "SIGQUIT"):
    if hasattr(signal, name):
        delattr(signal, name)
"""
EVERY_MODULE = """
package = importlib.import_module(sys.argv[1])
names = [each.name for each in pkgutil.walk_packages(package.__path__, package.__name__ + ".")]
left_out = (
    ".".join([package.__name__, "_kernels"]),  # compiled with numba where it is there
    # Rerun's library brings psutil, which chooses its own modules by the system
    *(".".join([package.__name__, each]) for each in ("cli.rerun", "robotics._rerun")),
)
for name in names:
    if not name.startswith(left_out):
        importlib.import_module(name)
print(len(names))
"""
MOMENTS = """
import numpy as np, transientcam_moments as tm
phase_rad = np.linspace(0.5, 5.5, 5000)
b = 100 * np.exp(1j * np.arange(4)[:, None] * phase_rad)
b[0] += 1
found = tm.reconstruct(b.astype(np.complex64), tm.Settings(23e6, smoothing_sigma_px=0.0), threads=2)
density = tm.density(found.coefficients, [0.0, 1.0])
expected_m = tm.range_m(phase_rad, 23e6)
print(np.abs(found.range_m - expected_m).max() < 1e-3, density.shape)
"""
CLIENT = """
import asyncio, transientcam
from transientcam.cli import run
url = sys.argv[1]
with transientcam.Camera(url) as camera:
    print(camera.frame("range", wait_s=10).array.shape)
    with camera.stream("range") as stream:
        print(stream.receive().product)

async def main():
    async with transientcam.AsyncCamera(url) as camera:
        return (await camera.frame("flags", wait_s=10)).product

print(asyncio.run(main()), run(["--help"]) in (0, None))
"""


def without_linux(program: str, *arguments: str) -> str:
    result = subprocess.run(
        [sys.executable, "-W", "error", "-c", WITHOUT_LINUX + program, *arguments],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


@pytest.mark.parametrize("package", ["transientcam", "transientcam_moments"])
def test_every_module_is_imported_without_what_only_linux_has(package: str) -> None:
    assert int(without_linux(EVERY_MODULE, package)) > 20


def test_the_moments_are_computed_without_what_only_linux_has() -> None:
    assert without_linux(MOMENTS).split() == ["True", "(2,", "5000)"]


def test_the_client_talks_to_a_daemon_without_what_only_linux_has() -> None:
    with serving() as daemon:
        said = without_linux(CLIENT, daemon.url)

    assert said.startswith("(120, 163)\nrange\n")
    assert said.rstrip().endswith("flags True")


def test_the_test_would_notice() -> None:
    """What the others rest on: a module of the list is really refused."""
    with pytest.raises(AssertionError, match="No module named 'fcntl'"):
        without_linux("import fcntl")
