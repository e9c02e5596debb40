"""Shaders follow from the functions that state the mathematics."""

import re

import pytest

from transientcam_moments._gpu import _shader
from transientcam_moments._gpu._fits import likelihood_shader
from transientcam_moments.images import phasors
from transientcam_moments.likelihood import choice, planar, scaled, sharp, start, tail
from transientcam_moments.moment_problem import circle, eigenvalue, sparse, toeplitz

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
    build = likelihood_shader.__wrapped__
    assert build(3, 3, (3, 1))

    monkeypatch.delattr(module, name)

    with pytest.raises((AttributeError, NameError), match=name):
        build(3, 3, (3, 1))


@pytest.mark.parametrize("zeroth", ["low-frequency", "on-off", "estimated", None])
@pytest.mark.parametrize("m", ORDERS)
def test_every_variable_has_a_value_from_the_start(m: int, zeroth: str | None) -> None:
    """Two of three compilers do not zero what is declared in a loop."""
    code = _shader.shader(m, zeroth, images=zeroth is not None)
    code += likelihood_shader(m, 3, choice.TAIL_SHAPES) if zeroth is None else ""

    declared = [line for line in code.splitlines() if re.match(r"\s*var ", line)]

    assert declared
    assert [line for line in declared if "=" not in line] == []


@pytest.mark.parametrize("m", ORDERS)
def test_no_quotient_or_root_is_trusted_beyond_what_a_device_promises(m: int) -> None:
    code = _shader.shader(m, "low-frequency", images=True)
    fits = likelihood_shader(m, 3, choice.TAIL_SHAPES)

    body = code[code.index("fn measure(") :].replace("p / params.width", "")
    body += fits[fits.index("fn estimate(") :]
    body = re.sub(r"/\*.*?\*/|//.*", "", body)

    assert " / " not in body
    assert re.findall(r"\b(sqrt|atan2?|sin|cos|exp|log|pow|inverseSqrt|fma)\(", body) == []
