"""The machine a measurement was taken on, in words for the page that states it."""

import os
import platform
import subprocess
from importlib.metadata import version
from pathlib import Path
from typing import Final

_KIND: Final = {"family": "cpu family", "model": "model"}
_VECTORS: Final = {"AVX-512": "avx512f", "AVX2": "avx2", "AVX": "avx"}


def machine() -> str:
    """Return processor, cores, system and the versions that matter, in one line."""
    cores = len(os.sched_getaffinity(0))
    versions = ", ".join(f"{name} {version(name)}" for name in ("numpy", "numba"))
    system = f"{platform.system()} {platform.release().split('-')[0]}"
    return (
        f"{_processor()}, {cores} cores, {system}, Python {platform.python_version()}, {versions}"
    )


def commit_of(checkout: Path) -> str:
    """Return the short name of the commit that a checkout is at, and whether files are changed."""

    def git(*words: str) -> str:
        command = ["git", "-C", str(checkout), *words]
        return subprocess.run(command, capture_output=True, check=True, text=True).stdout.strip()

    changed = git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!docs")
    return git("rev-parse", "--short=8", "HEAD") + (" and changes" if changed else "")


def _processor() -> str:
    """Name the processor, and its family and vectors: one name is sold with several of both."""
    facts: dict[str, str] = {}
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        name, _, value = line.partition(":")
        facts.setdefault(name.strip(), value.strip())
    if "model name" not in facts:
        return platform.machine()
    kind = [f"{word} {facts[key]}" for word, key in _KIND.items() if key in facts]
    flags = facts.get("flags", "").split()
    kind += next(([name] for name, flag in _VECTORS.items() if flag in flags), [])
    return f"{facts['model name']} ({', '.join(kind)})" if kind else facts["model name"]
