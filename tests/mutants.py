"""Random mutants of what must not err, each held against the tests that mirror its module.

``make mutants`` prints those that no test notices: gaps, or equivalents, which
docs/measured/notes/mutants.md names. The operators are those of cosmic-ray, whose own sessions run
every mutant of a module; this draws a place, a module of it, a position and a change of it, each
uniformly. Only a copy of the tree is changed.
"""

import argparse
import difflib
import importlib
import multiprocessing
import os
import random
import re
import resource
import shutil
import signal
import sys
import tempfile
from collections import Counter, defaultdict
from functools import cache
from pathlib import Path

import pytest
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

PLACES = {
    "wire": "client/transientcam/wire",
    "protocol": "driver/transientcam_driver/cameras/open_usb/protocol",
    "receiving": "driver/transientcam_driver/cameras/open_usb/_receiving",
    "lease": "server/transientcam_server/camera/_lease.py",
    "outbox": "server/transientcam_server/broadcast/_outbox.py",
    "recording": "server/transientcam_server/recording",
    "planning": "server/transientcam_server/planning",
    "moments": "server/transientcam_moments",
}
COMPILED = {"_kernels", "_lanes"}
"""Rooms of the mathematics whose tests compile for minutes."""
PACKAGES = {
    "client/transientcam": "tests/client",
    "driver/transientcam_driver": "tests/driver",
    "server/transientcam_server": "tests/server",
    "server/transientcam_moments": "tests/moments",
}
ROOT = Path(__file__).parents[1]
CPU_S, TIMEOUT_S = 60, 600.0
"""Of the tests of one mutant: what a busy machine does not stretch, and for those that wait."""
LARGE = ("crc32c", "fastapi", "h5py", "httpx", "hypothesis", "numba", "numpy", "scipy.optimize")
OPERATORS = re.compile(
    r"core/(ReplaceComparisonOperator_((?!.*Is)|Is_IsNot|IsNot_Is)"
    r"|ReplaceBinaryOperator_(?!.*(Bit|Shift))|ReplaceUnaryOperator|Replace(True|False|And|Or)"
    r"|AddNot|NumberReplacer|ExceptionReplacer|ZeroIteration)"
)
"""Without ``|``, which types have, and without ``is`` in place of ``==``."""


def mirroring(module: Path) -> list[Path]:
    """Return the tests of a module: the file named after it, if there is one, then its room."""
    package, tests = next(each for each in PACKAGES.items() if module.is_relative_to(each[0]))
    parts = [part.lstrip("_") for part in module.relative_to(package).with_suffix("").parts]
    room = Path(tests, *parts[:-1])
    return [each for each in (room / f"test_{parts[-1]}.py", room) if (ROOT / each).exists()]


def modules(place: str) -> list[Path]:
    """Return the modules of a place, relative to the root, but for those without code to change."""
    inside = sorted((ROOT / place).rglob("*.py")) or [ROOT / place]
    found = (each.relative_to(ROOT) for each in inside if each.name != "__init__.py")
    return [each for each in found if not COMPILED.intersection(each.parts)]


def draw(code: str, rng: random.Random) -> str | None:
    """Return code with one change, None where there is nothing to change.

    A decorator stays: that a dataclass is frozen or has slots is what mypy checks.
    """
    nodes = list(ast_nodes(get_ast(code)))
    decorators = [(each.start_pos, each.end_pos) for each in nodes if each.type == "decorator"]
    changes = defaultdict(list)
    for name in filter(OPERATORS.match, operator_names()):
        operator = get_operator(name)()
        places = (start for node in nodes for start, _ in operator.mutation_positions(node))
        for occurrence, start in enumerate(places):
            if not any(first <= start < last for first, last in decorators):
                changes[start].append((operator, occurrence))
    if not changes:
        return None
    changed: str | None = mutate_code(code, *rng.choice(changes[rng.choice(sorted(changes))]))
    return changed


def _test(tests: Path) -> None:
    os.setsid()
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S))
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    options = ("-x", "-n0", "-p", "no:cacheprovider", "--assert=plain")
    os._exit(pytest.main([*options, str(tests)]))


def outcome(tests: Path) -> str:
    """Return how tests end in the working directory: survived, noticed or timeout.

    They run in a fork, which has the large packages that it imports.
    """
    process = multiprocessing.get_context("fork").Process(target=_test, args=(tests,))
    process.start()
    process.join(TIMEOUT_S)
    if process.exitcode is None and process.pid is not None:
        os.killpg(process.pid, signal.SIGKILL)
        process.join()
        return "timeout"
    ended: dict[int | None, str] = {0: "survived", 1: "noticed", 2: "noticed"}
    return ended.get(process.exitcode, f"ended by {process.exitcode}")


@cache
def outcome_of_none(tests: Path) -> str:
    """Return how tests end without a mutant."""
    return outcome(tests)


def held(copy: Path, module: Path, code: str) -> str:
    """Return how the tests of a module end with other code in its place, in a copy."""
    for tests in mirroring(module)[:1]:
        if outcome_of_none(tests) != "survived":
            raise SystemExit(f"{tests} fails as it is")
    file = copy / module
    before, times = file.read_bytes(), file.stat()
    file.write_text(code, "utf-8")
    try:
        for tests in mirroring(module):
            ended = outcome(tests)
            if ended != "survived":
                return ended
        return "survived"
    finally:
        file.write_bytes(before)
        os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))


def main() -> None:
    """Draw mutants, hold each against its tests, print those that survive."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seed", type=int)
    parser.add_argument("count", type=int)
    parser.add_argument("places", nargs="*", default=list(PLACES), choices=[*PLACES, []])
    options = parser.parse_args()
    rng = random.Random(options.seed)
    ended: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as directory:
        copy = Path(directory, "tree")
        ignored = shutil.ignore_patterns(".*", "node_modules", "__pycache__", "build", "dist")
        shutil.copytree(ROOT, copy, ignore=ignored)
        os.chdir(copy)
        sys.path[:1] = [str(copy / each) for each in ("", "client", "driver", "server")]
        os.environ["PYTHONPATH"] = os.pathsep.join(sys.path[:4])
        for each in LARGE:
            importlib.import_module(each)
        while ended.total() < options.count:
            module = rng.choice(modules(PLACES[rng.choice(options.places)]))
            code = (ROOT / module).read_text("utf-8")
            changed = draw(code, rng)
            if changed is None:
                continue
            result = held(copy, module, changed)
            ended[result] += 1
            if result != "noticed":
                lines = difflib.unified_diff(
                    code.splitlines(), changed.splitlines(), n=0, lineterm=""
                )
                print(result, module, *list(lines)[2:], sep="\n    ", flush=True)
    print(*(f"{number} {each}" for each, number in ended.items()), sep=", ")


if __name__ == "__main__":
    main()
