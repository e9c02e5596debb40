"""What can be said of shaders without a GPU, for docs/gpu.md: ``python -m tools.gpu --write``.

Registers: each shader as CUDA C, compiled for sm_90 by `nvcc` (packages nvidia-cuda-nvcc and
nvidia-cuda-runtime; ``--nvcc PATH``). Estimates: operations that pixels take, counted while a
software device (llvmpipe) runs the shader, and bytes that go each way.
"""

import argparse
import re
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from benchmarks.common.records import DOCS, ROOT
from transientcam_moments._gpu import Device, _golden, _kernels, _passes
from transientcam_moments._gpu._kernels import asked, kernel_shader
from transientcam_moments._gpu._shader import shader
from transientcam_moments.likelihood import choice

BEGIN: Final = "<!-- `python -m tools.gpu --write` writes what follows -->\n"
END: Final = "<!-- up to here -->\n"
PHASES: Final = 256
PIXELS: Final = 640 * 480
SHADERS: Final = ("pass", "likelihood", "density", "cumulative")


def code_of(name: str, m: int) -> str:
    """Return a shader of an order, as it ships."""
    if name == "pass":
        return shader(m, "low-frequency", images=True)
    return kernel_shader(name, m, *((3, choice.TAIL_SHAPES) if name == "likelihood" else ()))


# -- registers ---------------------------------------------------------------------------------

_CUDA: Final = """
struct vec2 { float x, y; }; struct ivec2 { int x, y; };
#define OP __device__ __forceinline__
OP vec2 operator+(vec2 a, vec2 b) { return {a.x + b.x, a.y + b.y}; }
OP vec2 operator-(vec2 a, vec2 b) { return {a.x - b.x, a.y - b.y}; }
OP vec2 operator-(vec2 a) { return {-a.x, -a.y}; }
OP vec2 operator*(vec2 a, float b) { return {a.x * b, a.y * b}; }
OP vec2 operator*(float b, vec2 a) { return a * b; }
OP void operator+=(vec2& a, vec2 b) { a = a + b; }
OP void operator*=(vec2& a, float b) { a = a * b; }
OP float divide(float a, float b);
OP float square_root(float x);
template <class T> OP T select(T a, T b, bool c) { return c ? b : a; }
"""
_WORDS: Final[dict[str, Any]] = {
    r"//[^\n]*": "",
    r"@group\(0\) @binding\(\d\) var<uniform> params: Params;": "__constant__ Params params;",
    r"@group\(0\) @binding\(\d\) var<storage, read> (\w+): array<(.*?)>;":
        r"__constant__ const \2* __restrict__ \1;",
    r"@group\(0\) @binding\(\d\) var<storage, read_write> (\w+): array<(.*?)>;":
        r"__constant__ \2* __restrict__ \1;",
    r"arrayLength\(&places\)": "params.bad",
    r"bitcast<f32>": "__uint_as_float",
    r"bitcast<u32>": "__float_as_uint",
    r"vec2<f32>\(\)": "vec2{}",
    r"vec2<(f|i)32>\(((?:[^()]|\([^()]*\)|\((?:[^()]|\([^()]*\))*\))*)\)": r"@\1{\2}",
    r"vec2<f32>": "vec2",
    r"@f\{": "vec2{",
    r"@i\{": "ivec2{",
    r"struct Params \{(.*?)\n\}": lambda found: "struct Params {"
        + re.sub(r"(\w+): (\w+),", r"\2 \1;", found[1]) + "\n};",
    r"fn (\w+)\(([^@)]*)\) -> (\w+) \{": lambda found: f"OP {found[3]} {found[1]}("
        + re.sub(r"(\w+): (\w+)", r"\2 \1", found[2]) + ") {",
    r"@compute @workgroup_size\((\d+)\)\s*fn (\w+)\(.*?\) \{":
        r'extern "C" __global__ void __launch_bounds__(\1) \2() { const uint3 id = '
        r"{blockIdx.x * \1 + threadIdx.x, blockIdx.y, 0};",
    r"\b(let|var) (\w+): (\w+) =": r"\3 \2 =",
    r"\b(let|var) (\w+) =": r"auto \2 =",
    r"(?<![\w.])(\d+\.\d*(?:e[-+]?\d+)?|\d+e[-+]?\d+)(?![\w.])": r"\1f",
    r"\bf32\b": "float",
    r"\bu32\b": "unsigned",
    r"\bi32\b": "int",
}  # fmt: skip


def cuda_of(code: str) -> str:
    """Return a shader as CUDA C."""
    for pattern, text in _WORDS.items():
        code = re.sub(pattern, text, code, flags=re.DOTALL if "struct" in pattern else 0)
    return _CUDA + code


def registers(nvcc: str) -> Iterator[tuple[str, ...]]:
    """Yield shader, and of each order registers, with bytes spilled if there are any."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "shader.cu")
        for name in SHADERS:
            row = [name]
            for m in range(1, 9):
                source.write_text(cuda_of(code_of(name, m)), "utf-8")
                how = ["-arch=sm_90", "-Xptxas=-v", "-cubin", "-o", f"{folder}/out", str(source)]
                done = subprocess.run([nvcc, *how], capture_output=True, text=True, check=False)
                if done.returncode:
                    raise SystemExit(done.stderr[:2000])
                row.append(_used(done.stderr))
            yield tuple(row)


def _used(said: str) -> str:
    stack, stores, loads = (
        max(map(int, re.findall(rf"(\d+) bytes {kind}", said)))
        for kind in ("stack frame", "spill stores", "spill loads")
    )
    used = max(map(int, re.findall(r"Used (\d+) registers", said)))
    return f"{used} / {stores + loads} / {stack}"


# -- operations --------------------------------------------------------------------------------

_COSTS: Final = {
    "quotient": 15, "root_of": 21, "lost_by_squaring": 12, "rounded": 1, "times": 6, "log_of": 145,
    "log_1p": 140, "finite": 2, "image": 8, "select": 1, "max": 1, "min": 1, "conjugate": 1,
}  # fmt: skip
"""Operations of words: a quotient or root of the device's counts as 8."""


class Machine(NamedTuple):
    """A machine that isn't at hand, by its data sheet."""

    name: str
    operations_per_s: float
    """Half of what it could start: products and sums count by themselves, and wait for others."""
    memory_bytes_per_s: float
    bus_bytes_per_s: float


MACHINES: Final = (
    Machine("laptop GPU (2 TFLOP/s, 60 GB/s, copies at 10 GB/s)", 0.5e12, 60e9, 10e9),
    Machine("H100 (67 TFLOP/s, 3.35 TB/s, PCIe at 25 GB/s)", 17e12, 3.35e12, 25e9),
)


def _cost(line: str) -> int:
    line = re.sub(r"\[[^\]]*\]|/\*.*?\*/", "", line)
    operators = len(re.findall(r" (?:[-+*&|<>^]|[<>=!]=|&&|\|\||[-+*]=) ", line))
    words = sum(_COSTS.get(word, 0) for word in re.findall(r"\b(\w+)\(", line))
    return operators * (2 if re.match(r"\s*b\d|let \w+: vec2", line) else 1) + words


def counted(code: str, entry: str, row: int) -> str:
    """Return a shader that puts how many operations an entry took in a row of its results."""
    beginning = "if (p >= pixels) { return; }"
    before, body = code.split(f"fn {entry}(")
    opened, lines = body.rstrip().removesuffix("}").split(beginning)
    text, cost = [f"{before}fn {entry}({opened}{beginning}", "var ops = 0u;"], 0
    for line in lines.split("\n"):
        cost += _cost(line)
        if "{" in line or line.strip().startswith("}"):
            text.append(f"ops += {cost}u;")
            cost = 0
        text.append(line)
    text += [f"ops += {cost}u;", f"out[{row}u * pixels + p] = bitcast<u32>(f32(ops));", "}"]
    return "\n".join(text)


class Count(NamedTuple):
    """What a frame of a shader takes, of a pixel."""

    operations: float
    of_32: float
    """Of the slowest of 32 pixels in a row, over the mean."""
    memory_bytes: float
    bus_bytes: float


def counts(device: Device, name: str, m: int) -> Count:
    """Count the operations of a known frame of three returns, with noise."""
    found: list[tuple[Any, Any]] = []

    def run(one: Any, given: Any) -> None:
        code, kind = one.code, ("analyse", 3) if name == "pass" else ("estimate", 0)
        one.code = counted(code, *kind)
        out = device.frame(one, given)
        if out is None:
            raise SystemExit(f"{name}, m = {m}: {device.failed}")
        ahead = code.partition("fn measure(")[2].partition("@compute")[0]  # has no loops
        found.append((out[kind[1]] + sum(map(_cost, ahead.split("\n"))), one))

    def make(m: int, shape: Any, constants: Any) -> Any:
        return _passes.DevicePass(run, m, shape, constants, images=True)

    def compute(*given: Any) -> None:
        if name != "likelihood":
            given = *given[:3], np.linspace(0, 2 * np.pi, PHASES, endpoint=False)
        wanted = asked(name, given)
        one = _kernels.DeviceKernel(name, m, given[0].shape[1], wanted, hostile=False)
        run(one, [wanted.data])

    _golden.wrong(m, make) if name == "pass" else _golden.wrong_kernel(name, m, compute)
    ((ops, one),) = found
    groups = ops[: len(ops) // 32 * 32].reshape(-1, 32)
    raw, _, moments, out = (size / one.pixels for size in one.sizes)
    memory = raw + out + moments * (2 if raw else 1)
    return Count(ops.mean(), groups.max(1).mean() / groups.mean(), memory, (raw or moments) + out)


def estimates() -> Iterator[tuple[str, ...]]:
    """Yield shader, order, what its pixels take, and frames a second of each machine."""
    device = Device("gpu:llvmpipe")
    for name in SHADERS:
        for m in (3, 4, 8):
            one = counts(device, name, m)
            rates = []
            for each in MACHINES:
                there_s = PIXELS * max(
                    one.operations * one.of_32 / each.operations_per_s,
                    one.memory_bytes / each.memory_bytes_per_s,
                )
                copied_s = there_s + PIXELS * one.bus_bytes / each.bus_bytes_per_s
                rates.append(f"{_short(1 / there_s)} / {_short(1 / copied_s)}")
            taken = one.operations, one.of_32, one.memory_bytes, one.bus_bytes
            yield name, f"{m}", *map(_short, taken), *rates
    device.close()


def _short(number: float) -> str:
    return f"{float(f'{number:.2g}'):,.10g}"


# -- the page ----------------------------------------------------------------------------------


def table(heads: str, rows: Iterator[tuple[str, ...]]) -> str:
    """Return a table of Markdown."""
    lines = [f"| {heads} |", "|---" * (heads.count("|") + 1) + "|"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)]) + "\n"


def main() -> None:
    """Print both tables, or write them into the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--nvcc", default="nvcc")
    parser.add_argument("--write", action="store_true", help="into docs/gpu.md")
    given = parser.parse_args()
    said = subprocess.run([given.nvcc, "--version"], capture_output=True, text=True, check=True)
    commit = ["git", "-C", str(ROOT), "describe", "--always", "--dirty"]
    at = subprocess.run(commit, capture_output=True, text=True, check=True).stdout.strip()
    release = re.findall(r"V([\d.]+)", said.stdout)[0]
    heads = "shader | " + " | ".join(f"m = {m}" for m in range(1, 9))
    text = f"""
Registers, bytes spilled and bytes of stack for sm_90 (H100), by nvcc {release}, commit {at}.
Nothing ran. Of a pass's two entries the larger numbers stand here.

{table(heads, registers(given.nvcc))}
**Estimates, not measurements**, of frames of 640 x 480 a second, on the device / with copies there
and back. Operations were counted while llvmpipe ran the shader on a frame of three returns with
noise (commit {at}; films of {PHASES} phases). A GPU is taken to start half as many as its data
sheet lets it, and groups of 32 pixels to wait for their slowest.

"""
    heads = "shader | m | operations a pixel | slowest of 32 | bytes of memory | bytes copied"
    text += table(" | ".join([heads, *(each.name for each in MACHINES)]), estimates())
    if not given.write:
        print(text)
        return
    page = DOCS / "gpu.md"
    before, _, rest = page.read_text("utf-8").partition(BEGIN)
    page.write_text(before + BEGIN + text + END + rest.partition(END)[2], "utf-8")


if __name__ == "__main__":
    main()
