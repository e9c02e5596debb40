"""Random mutants of what must not err, each held against the tests that mirror its module.

``make mutants`` prints those that no test notices: gaps, or equivalents, which
docs/measured/notes/mutants.md names. The operators are those of cosmic-ray, whose own sessions run
every mutant of a module; this draws a place, a module of it, a position and a change, in a copy.
"""

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
COMPILED = {"_kernels"}  # rooms whose tests compile for minutes
OPERATORS = re.compile(
    r"core/(ReplaceComparisonOperator_((?!.*Is)|Is_IsNot|IsNot_Is)"
    r"|ReplaceBinaryOperator_(?!.*(Bit|Shift))|ReplaceUnaryOperator|Replace(True|False|And|Or)"
    r"|AddNot|NumberReplacer|ExceptionReplacer|ZeroIteration)"
)
"""Without ``|``, which types have, and ``is`` in place of ``==``."""
UNPACKING = {"argument", "dictorsetmaker", "param", "parameters", "star_expr"}
CPU_S, TIMEOUT_S = 120, 600.0
"""Of the tests of one mutant: what a busy machine does not stretch, and for those that wait."""
LARGE = ("crc32c", "fastapi", "h5py", "httpx", "hypothesis", "numba", "numpy", "scipy.optimize")
# by pytest's exit code: a test fails; a module or conftest cannot be imported
ENDED: dict[int | None, str] = {0: "survived", 1: "noticed", 2: "noticed", 4: "noticed"}


def mirroring(module: Path) -> list[Path]:
    """Return the tests of a module: the file named after it, if there is one, then its room."""
    floor, package, *parts = (part.lstrip("_") for part in module.with_suffix("").parts)
    tests = "moments" if package == "transientcam_moments" else floor
    room = Path("tests", tests, *parts[:-1])
    return [each for each in (room / f"test_{parts[-1]}.py", room) if each.exists()]


def modules(place: str) -> list[Path]:
    """Return the modules of a place whose tests do not compile."""
    inside = sorted(Path(place).rglob("*.py")) or [Path(place)]
    return [each for each in inside if not COMPILED.intersection(each.parts)]


def draw(code: str, rng: random.Random) -> str | None:
    """Return code with one change; None where there is nothing to change.

    Decorators stay, as mypy checks that a dataclass is frozen, and stars that unpack.
    """
    nodes = list(ast_nodes(get_ast(code)))
    kept = [each for each in nodes if each.type == "decorator"]
    kept += [each for each in nodes if each.type == "operator" and each.parent.type in UNPACKING]
    changes = defaultdict(list)
    for name in filter(OPERATORS.match, operator_names()):
        operator = get_operator(name)()
        places = (start for node in nodes for start, _ in operator.mutation_positions(node))
        for occurrence, start in enumerate(places):
            if not any(each.start_pos <= start < each.end_pos for each in kept):
                changes[start].append((operator, occurrence))
    if not changes:
        return None
    return str(mutate_code(code, *rng.choice(changes[rng.choice(sorted(changes))])))


def _test(tests: Path) -> None:
    os.setsid()
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S))
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.dup2(1, 2)
    os._exit(pytest.main(["-x", "-n0", "-pno:cacheprovider", "--assert=plain", str(tests)]))


def outcome(tests: Path) -> str:
    """Return how tests end here; in a fork, which has the large packages that it imports."""
    (process := multiprocessing.get_context("fork").Process(target=_test, args=(tests,))).start()
    process.join(TIMEOUT_S)
    if process.exitcode is None and process.pid is not None:
        os.killpg(process.pid, signal.SIGKILL)
        process.join()
    return ENDED.get(process.exitcode, f"ended by {process.exitcode}")


as_it_is = cache(outcome)


def held(module: Path, mutant: str) -> str:
    """Return how the tests of a module end with a mutant in its place."""
    before, times = module.read_bytes(), module.stat()
    for tests in mirroring(module):
        if as_it_is(tests) == "noticed":
            raise SystemExit(f"{tests} fails without a mutant")
        if as_it_is(tests) != "survived":
            break  # a room that takes too long
        module.write_text(mutant, "utf-8")
        ended = outcome(tests)
        module.write_bytes(before)
        os.utime(module, ns=(times.st_atime_ns, times.st_mtime_ns))  # compiled files stay true
        if ended != "survived":
            return ended
    return "survived"


def main(seed: str, count: str, *places: str) -> None:
    """Draw mutants of some places, or of all; print those that are not noticed."""
    rng, ended = random.Random(int(seed)), Counter[str]()
    with tempfile.TemporaryDirectory() as directory:
        copy = Path(directory, "tree")
        ignored = shutil.ignore_patterns(".*", "node_modules", "__pycache__", "build")
        shutil.copytree(Path(__file__).parents[1], copy, ignore=ignored)
        os.chdir(copy)
        sys.path[:1] = [str(copy / each) for each in ("", "client", "driver", "server")]
        # with CI, hypothesis has no deadlines, and tries the same each time
        os.environ |= {"PYTHONPATH": os.pathsep.join(sys.path[:4]), "CI": "1"}
        list(map(importlib.import_module, LARGE))
        while ended.total() < int(count):
            module = rng.choice(modules(PLACES[rng.choice(places or list(PLACES))]))
            code = module.read_text("utf-8")
            if (mutant := draw(code, rng)) is None:
                continue
            ended[result := held(module, mutant)] += 1
            if result != "noticed":
                lines = difflib.unified_diff(code.splitlines(), mutant.splitlines(), n=0)
                print(result, module, *list(lines)[2:], sep="\n    ", flush=True)
    print(*(f"{number} {each}" for each, number in ended.items()), sep=", ")


if __name__ == "__main__":
    main(*sys.argv[1:])
