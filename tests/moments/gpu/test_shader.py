"""Shaders follow from the functions that state the mathematics."""

import re

import pytest

from transientcam_moments._gpu import _shader
from transientcam_moments._gpu._kernels import ARRANGED, kernel_shader
from transientcam_moments.images import phasors
from transientcam_moments.likelihood import choice, planar, scaled, sharp, start, tail
from transientcam_moments.moment_problem import (
    circle,
    eigenvalue,
    evaluation,
    integrals,
    maxima,
    sparse,
    toeplitz,
)

ORDERS = range(1, 9)


@pytest.mark.parametrize(
    ("module", "name"),
    [
        (phasors, "bucket"),
        (phasors, "low_frequency"),
        (phasors, "calibrated"),
        (toeplitz, "relative"),
        (toeplitz, "reflect"),
        (toeplitz, "below_one"),
        (toeplitz, "step_up"),
        (eigenvalue, "smallest_eigenvalue"),
        (eigenvalue, "_tridiagonalise"),
        (eigenvalue, "climb"),
        (eigenvalue, "margin"),
        (circle, "turn_roots"),
        (sparse, "definite"),
        (sparse, "circle_roots"),
        (sparse, "weigh"),
        (sparse, "sort"),
        (sparse, "returns"),
        (sparse, "separate"),
    ],
)
def test_without_a_statement_there_is_no_shader(
    module: object, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    build = _shader.shader.__wrapped__
    assert build(3, "low-frequency", images=True)

    monkeypatch.delattr(module, name)

    with pytest.raises((AttributeError, NameError), match=name):
        build(3, "low-frequency", images=True)


@pytest.mark.parametrize(
    ("module", "name"),
    [
        (scaled, "prepare"),
        (scaled, "attributes"),
        (sharp, "step"),
        (sharp, "try_phases"),
        (sharp, "deviations"),
        (tail, "step"),
        (tail, "weigh"),
        (sharp, "decompose"),
        (choice, "join"),
        (planar, "offer_tail"),
        (planar, "split"),
        (planar, "fit"),
        (start, "pisarenko"),
    ],
)
def test_without_a_statement_there_is_no_likelihood(
    module: object, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    build = kernel_shader.__wrapped__
    assert build("likelihood", 3, 3, (3, 1))

    monkeypatch.delattr(module, name)

    with pytest.raises((AttributeError, NameError), match=name):
        build("likelihood", 3, 3, (3, 1))


@pytest.mark.parametrize(
    ("kernel", "module", "name"),
    [
        ("density", evaluation, "any_two"),
        ("density", evaluation, "height"),
        ("density", toeplitz, "least_modulus"),
        ("cumulative", integrals, "moments_of"),
        ("cumulative", integrals, "disc_roots"),
        ("cumulative", integrals, "_shares"),
        ("cumulative", integrals, "_logarithm"),
        ("cumulative", integrals, "until"),
        ("cumulative", maxima, "move_poles"),
    ],
)
def test_without_a_statement_there_is_no_film(
    kernel: str, module: object, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    build = kernel_shader.__wrapped__
    assert build(kernel, 3)

    monkeypatch.delattr(module, name)

    with pytest.raises((AttributeError, NameError), match=name):
        build(kernel, 3)


@pytest.mark.parametrize("zeroth", ["low-frequency", "on-off", "estimated", None])
@pytest.mark.parametrize("m", ORDERS)
def test_every_variable_has_a_value_from_the_start(m: int, zeroth: str | None) -> None:
    """Two of three compilers do not zero what is declared in a loop."""
    code = _shader.shader(m, zeroth, images=zeroth is not None)
    code += kernels(m) if zeroth is None else ""

    declared = [line for line in code.splitlines() if re.match(r"\s*var ", line)]

    assert declared
    assert [line for line in declared if "=" not in line] == []


@pytest.mark.parametrize("m", ORDERS)
def test_no_quotient_or_root_is_trusted_beyond_what_a_device_promises(m: int) -> None:
    code = _shader.shader(m, "low-frequency", images=True)

    body = code[code.index("fn measure(") :].replace("p / params.width", "") + kernels(m)
    body = re.sub(r"/\*.*?\*/|//.*", "", body)

    assert " / " not in body
    assert re.findall(r"\b(sqrt|atan2?|sin|cos|exp|log|pow|inverseSqrt|fma)\(", body) == []


def kernels(m: int) -> str:
    """Return what is traced of the shaders of all kernels of an order."""
    codes = [kernel_shader("likelihood", m, 3, choice.TAIL_SHAPES)]
    codes += [kernel_shader(name, m) for name in ARRANGED if name != "likelihood"]
    return "".join(code[code.index("fn estimate(") :] for code in codes)
