"""JAX arrays, eagerly and under jit: the same results as NumPy."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import jax
import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments import oracles

PHASE = np.linspace(0.1, 6.0, 7)
gains = partial(tm.nominal_calibration, sub_phases_rad=(0.0, 0.5), zeroth="on-off")
low = partial(tm.measure, zeroth="low-frequency")

STAGES: dict[str, Callable[[Any], Any]] = {
    "levinson": tm.levinson,
    "moments_of": lambda b: tm.moments_of(tm.levinson(b)),
    "extend": lambda b: tm.extend(tm.levinson(b), 6),
    "from_reflection": lambda b: tm.from_reflection(b[0].real, tm.levinson(b).reflection),
    "density": lambda b: tm.density(tm.levinson(b), PHASE),
    "density by its series": lambda b: tm.density(tm.levinson(b), PHASE, evaluation="fourier"),
    "cumulative": lambda b: tm.cumulative(tm.levinson(b), PHASE),
    "smallest_eigenvalue": tm.smallest_eigenvalue,
    "bias": tm.bias,
    "bias keeping brightness": lambda b: tm.bias(b, keep="brightness"),
    "estimate_zeroth": tm.estimate_zeroth,
    "pisarenko": tm.pisarenko,
    "separate": lambda b: tm.separate(tm.pisarenko(b)),
    "peaks": lambda b: tm.peaks(tm.levinson(b)),
    "bounds": lambda b: tm.bounds(b, PHASE),
    "smoothed_density": lambda b: tm.smoothed_density(tm.levinson(b), PHASE),
    "flags": tm.flags,
    "smooth": lambda b: tm.smooth(b.reshape(b.shape[0], 4, 5)),
    "calibrate": lambda b: tm.calibrate(b, gains(b.shape[0] - 1)),
    "range_m": lambda b: tm.range_m(b[0].real, 23e6),
    "reconstruct": lambda b: (
        tm.reconstruct(
            b.reshape(b.shape[0], 4, 5), tm.Settings(23e6, estimator="pisarenko")
        ).range_m
    ),
    "average_takes": lambda b: tm.average_takes(abs(b)[None].repeat(4, axis=0)),
    "measure": lambda b: low(abs(b)[np.array([0, 1, 2, 3, 1, 2, 3, 0])]),
}


@pytest.fixture
def double_precision() -> Iterator[None]:
    with jax.enable_x64(True):
        yield


def moments() -> np.ndarray:
    b = oracles.random_moments(np.random.default_rng(0), 3, 20, noise=0.02)
    b[:, 3] = 0
    b[1, 4] = np.nan
    b[:, 5] = oracles.moments_of_returns([1.0], [2.0], 3)
    return b


def leaves(result: Any) -> list[np.ndarray]:
    return [np.asarray(leaf) for leaf in jax.tree.leaves(result)]


@pytest.mark.usefixtures("double_precision")
@pytest.mark.parametrize("stage", STAGES)
def test_jax_arrays_give_under_jit_what_numpy_arrays_give(stage: str) -> None:
    check(stage, jax.jit(STAGES[stage]))


@pytest.mark.usefixtures("double_precision")
@pytest.mark.parametrize("stage", ["levinson", "density", "bias", "flags", "smooth", "measure"])
def test_jax_arrays_give_eagerly_what_numpy_arrays_give(stage: str) -> None:
    check(stage, STAGES[stage])


def check(stage: str, function: Callable[[Any], Any]) -> None:
    b = moments()
    expected = leaves(STAGES[stage](b))

    found = leaves(function(jax.numpy.asarray(b)))

    assert len(found) == len(expected)
    for mine, theirs in zip(found, expected, strict=True):
        assert mine.shape == theirs.shape
        assert mine.dtype == theirs.dtype
        scale = np.abs(np.nan_to_num(theirs.astype(complex))).max(initial=1)
        assert np.allclose(mine, theirs, rtol=1e-8, atol=1e-8 * scale, equal_nan=True)


@pytest.mark.usefixtures("double_precision")
def test_single_precision_stays_single() -> None:
    b = jax.numpy.asarray(moments().astype(np.complex64))

    def cut(b: Any) -> Any:
        return tm.levinson(b), tm.pisarenko(b), tm.density(tm.levinson(b), PHASE)

    # traced as under jit, which would compile it, too
    dtypes = {leaf.dtype for leaf in jax.tree.leaves(jax.eval_shape(cut, b))}

    assert dtypes == {np.dtype(kind) for kind in ("complex64", "float32", "int32")}


def test_results_are_jax_arrays() -> None:
    result = tm.levinson(jax.numpy.asarray(moments()))

    assert isinstance(result.error, jax.Array)


def test_without_double_precision_everything_works_in_single() -> None:
    jax.clear_caches()  # type: ignore[no-untyped-call]  # the other tests' are double
    b = jax.numpy.asarray(moments().astype(np.complex64))
    found = tm.separate(tm.pisarenko(tm.bias(b).moments))
    h = tm.density(tm.levinson(b), PHASE)

    expected = tm.separate(tm.pisarenko(tm.bias(moments()).moments))
    valid = np.arange(20) != 4
    assert found.direct.dtype == h.dtype == np.float32
    assert np.abs(np.asarray(found.direct) - expected.direct)[valid].max() < 0.1
