"""Kernels are compiled by another process, and loaded by this one."""

import os
import subprocess
import sys
from pathlib import Path

from transientcam_moments._dispatch import Key

KERNEL = Key("smallest_eigenvalue", 1, "f")


def printed(code: str, cache: Path, *, setting: str = "on") -> str:
    environ = {"NUMBA_CACHE_DIR": str(cache), "TRANSIENTCAM_KERNELS": setting}
    command = [sys.executable, "-W", "error", "-c", code]
    return subprocess.check_output(command, env=os.environ | environ, text=True).strip()


def test_a_kernel_is_compiled_by_another_process_and_loaded_by_this_one(tmp_path: Path) -> None:
    code = (
        "import numpy as np, transientcam_moments as tm\n"
        "tm.smallest_eigenvalue(np.ones((2, 4096), np.complex64))\n"
        "import threading\n"
        "[each.join() for each in threading.enumerate() if each.name == tm.kernels.THREAD]\n"
        "from transientcam_moments._kernels.eigenvalue import smallest_eigenvalue as kernel\n"
        "print(tm.kernels.state()['compiled'], sum(kernel.stats.cache_hits.values()))\n"
    )

    assert printed(code, tmp_path) == f"['{KERNEL}'] 1", (
        "the cache of a new directory was not filled"
    )


def test_what_is_not_kept_is_not_compiled_by_loading(tmp_path: Path) -> None:
    code = (
        "from contextlib import suppress\n"
        "from transientcam_compiled import NotKept, only_from_cache\n"
        "from transientcam_moments._kernels.compiler import compile_kernel\n"
        "from transientcam_moments._dispatch import Key\n"
        f"key = Key(*{tuple(KERNEL)})\n"
        "def load():\n"
        "    with suppress(NotKept), only_from_cache(): return compile_kernel(key)\n"
        "print(load(), compile_kernel(key) is None, load() is None)\n"
    )

    assert printed(code, tmp_path, setting="manual") == "None False False"
