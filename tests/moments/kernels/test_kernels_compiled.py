"""Compiled kernels against the planar statement beside them, and against LAPACK."""

import itertools
import threading
import weakref
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from tests.moments import oracles
from tests.moments.compiled_kernels import FEW, find, kernels, without_kernels
from transientcam_compiled import BLOCK, Part, blocks
from transientcam_compiled._spread import LARGE
from transientcam_moments._kernels import density as density_module, phase_groups
from transientcam_moments.moment_problem._levinson import _levinson
from transientcam_moments.moment_problem._polishing import residual, size

ORDERS = [3, 8]
LANES = tuple(name for name in FEW if name != "reconstruct")
TYPES = [np.complex64, np.complex128]
Array = NDArray[Any]
PHASES: dict[str, Callable[[int], Array]] = {
    "any": lambda count: np.random.default_rng(count).uniform(-10, 10, count),
    "equidistant": lambda count: np.linspace(-3, 10, count),
    "turn": lambda count: 0.5 + np.linspace(0, 2 * np.pi, count, endpoint=False),
    "turn back": lambda count: 0.5 - np.linspace(0, 2 * np.pi, count, endpoint=False),
}


@pytest.fixture(autouse=True, scope="module")
def compiled() -> Iterator[None]:
    with kernels(*ORDERS, names=LANES):
        yield


def kernel(name: str, planes: Array) -> Any:
    found = find(name, planes)
    assert found is not None
    return found


def eps(planes: Array) -> float:
    return float(np.finfo(planes.dtype).eps)


def varied_moments(m: int, dtype: type, *, pixels: int = 1003) -> Array:
    """Few and many returns, with and without noise and a uniform part; some indefinite."""
    rng = np.random.default_rng(m)
    parts = []
    for returns, noise in ((1, 1e-3), (2, 1e-3), (3, 3e-2), (2 * m + 3, 0.0), (2 * m + 3, 0.3)):
        phase, weight = oracles.random_returns(rng, returns=returns, pixels=pixels // 5 + 1)
        b = oracles.moments_of_returns(phase, weight, m)
        b += noise * b[0].real * (rng.normal(size=b.shape) + 1j * rng.normal(size=b.shape))
        parts.append(b * rng.lognormal(size=b.shape[1]))
    b = np.concatenate(parts, axis=1)[:, rng.permutation(pixels)]
    b[0] = b[0].real
    return b.astype(dtype)


def special_moments(m: int, dtype: type) -> tuple[Array, dict[str, slice]]:
    """Pixels that break what is usual, each kind eight times, among usual ones."""
    b = varied_moments(m, dtype)
    finfo = np.finfo(dtype)
    kinds: dict[str, Any] = {
        "zero": lambda b: 0 * b,
        "uniform": lambda b: b * (np.arange(m + 1) == 0)[:, None],
        "NaN in b_0": lambda b: b * np.where(np.arange(m + 1) == 0, np.nan, 1)[:, None],
        "NaN in b_m": lambda b: b * np.where(np.arange(m + 1) == m, np.nan, 1)[:, None],
        "infinite b_1": lambda b: np.where((np.arange(m + 1) == 1)[:, None], np.inf, b),
        "negative b_0": lambda b: b * np.where(np.arange(m + 1) == 0, -1, 1)[:, None],
        "no b_0": lambda b: b * (np.arange(m + 1) > 0)[:, None],
        "huge": lambda b: b * (finfo.max / 1e4),
        "tiny": lambda b: b * (finfo.tiny * 1e3),
        "subnormal": lambda b: b * (finfo.tiny / 64),
    }
    where = {}
    with np.errstate(all="ignore"):
        for index, (kind, change) in enumerate(kinds.items()):
            where[kind] = slice(50 + 40 * index, 58 + 40 * index)
            b[:, where[kind]] = change(b[:, where[kind]]).astype(dtype)
    return b, where


@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("m", ORDERS)
def test_smallest_eigenvalues_are_those_of_lapack(m: int, dtype: type) -> None:
    b = varied_moments(m, dtype)

    found = kernel("smallest_eigenvalue", b)(b)

    expected = oracles.smallest_eigenvalue(b.astype(complex))
    assert found.dtype == b.real.dtype
    assert (np.abs(found - expected) < 8 * (m + 1) * eps(b) * np.abs(b).max(axis=0)).all()


@pytest.mark.parametrize("m", ORDERS)
def test_equal_smallest_eigenvalues_are_found_to_the_last_digits(m: int) -> None:
    """One return leaves m equal ones, and none of them helps the iteration to converge."""
    phase = np.random.default_rng(m).uniform(0, 2 * np.pi, (1, 128))
    b = oracles.moments_of_returns(phase, np.ones((1, 128)), m)
    b[0] += 0.25

    found = kernel("smallest_eigenvalue", b)(b)

    assert np.abs(found - 0.25).max() < 8 * (m + 1) * eps(b)


@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("m", ORDERS)
def test_eigenvalues_of_special_pixels_follow_the_planar_statement(m: int, dtype: type) -> None:
    b, where = special_moments(m, dtype)

    found = kernel("smallest_eigenvalue", b)(b)

    with without_kernels():
        planar = tm.smallest_eigenvalue(b)
    scale = np.nan_to_num(np.abs(b).max(axis=0))
    assert np.array_equal(np.isnan(found), np.isnan(planar))
    usual = np.isfinite(planar) & (scale > np.finfo(dtype).tiny)
    error = np.abs(found[usual] - planar[usual]) / scale[usual]
    assert error.max() < 16 * (m + 1) * eps(b)
    assert (found[where["zero"]] == 0).all()


@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("m", ORDERS)
def test_levinson_follows_the_planar_statement(m: int, dtype: type) -> None:
    b, _ = special_moments(m, dtype)
    with np.errstate(all="ignore"):
        b = tm.bias(b).moments

    found = kernel("levinson", b)(b)

    planar = _levinson(b)
    with np.errstate(all="ignore"):
        # what the condition of the matrix makes of rounding
        condition = b[0].real / np.maximum(planar[0], b[0].real * eps(b))
    lit = np.isfinite(condition) & (np.abs(b[0]) > 1e3 * np.finfo(dtype).tiny)
    for part, expected in zip(found, planar, strict=True):
        assert part.dtype == expected.dtype
        assert part.shape == expected.shape
        assert np.array_equal(np.isnan(part), np.isnan(expected))
    assert np.all(np.abs(found[0] - planar[0])[lit] <= 16 * m * eps(b) * b[0].real[lit])
    for part, expected in zip(found[1:], planar[1:], strict=True):
        error = np.abs(part - expected).max(axis=0)[lit]
        assert (error < 64 * m * eps(b) * condition[lit]).all()
        assert np.array_equal(part[:, ~lit], expected[:, ~lit], equal_nan=True) or (
            np.allclose(part[:, ~lit], expected[:, ~lit], rtol=1e-2, equal_nan=True)
        )


@pytest.mark.parametrize("dtype", TYPES)
def test_levinson_takes_a_brightness_in_place_of_b_0(dtype: type) -> None:
    b, _ = special_moments(3, dtype)
    with np.errstate(all="ignore"):
        biased = tm.bias(b).moments

    beside = kernel("levinson", b)(b, biased[0].real)

    for part, expected in zip(beside, kernel("levinson", b)(biased), strict=True):
        assert np.array_equal(part, expected, equal_nan=True)


@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("m", ORDERS)
def test_indefinite_moments_are_projected_as_by_the_planar_statement(m: int, dtype: type) -> None:
    b = varied_moments(m, dtype)
    b[0] = 0.6 * np.abs(b[0])

    error, _, reflection = kernel("levinson", b)(b)

    planar = _levinson(b)
    assert (np.abs(reflection) < 1).all()
    assert (error > 0).all()
    # at the border of the cone all that is left of E is rounding; what follows it is zero in both
    assert np.array_equal(reflection[-1] == 0, planar[2][-1] == 0)
    inside = (reflection[-1] != 0) & (planar[0] > 1e-3 * b[0].real)
    assert inside.any()
    assert np.abs(reflection - planar[2])[:, inside].max() < 1e5 * eps(b)


@pytest.mark.parametrize("kind", PHASES)
@pytest.mark.parametrize("phases", [1, 2, 7, 8, 9, 64])
@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("m", ORDERS)
def test_densities_follow_the_planar_statement(m: int, dtype: type, phases: int, kind: str) -> None:
    b = tm.bias(varied_moments(m, dtype)).moments
    coefficients = tm.levinson(b)
    phase_rad = PHASES[kind](phases)

    found = tm.density(coefficients, phase_rad)

    with without_kernels():
        planar = tm.density(coefficients, phase_rad)
    assert found.shape == planar.shape == (phases, b.shape[1])
    assert found.dtype == b.real.dtype
    # a squared modulus of relative depth d is known to eps / sqrt(d)
    depth = np.abs(coefficients.polynomial).sum(axis=0) * np.sqrt(
        2 * np.pi * planar / coefficients.error
    )
    assert (np.abs(found / planar - 1) < 64 * m * eps(b) * depth).all()


def last_part_first(part: Part, total: int, /, unit: int = 1024, each: int = 1) -> None:
    cuts = [0, *range(unit, total - unit + 1, 5 * unit), total]
    for start, stop in reversed(list(itertools.pairwise(cuts))):
        part(start, stop)


@pytest.mark.parametrize("phases", [1, 5, 9, 12, 19])
@pytest.mark.parametrize("pixels", [64, 65, 72, 250, 2448, 2449])
@pytest.mark.parametrize("past_caches", [False, True])
@pytest.mark.parametrize("kind", ["equidistant", "turn"])
def test_densities_are_written_to_every_pixel_and_no_other_place(
    pixels: int, phases: int, past_caches: bool, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if past_caches:
        monkeypatch.setattr(density_module, "_PAST_CACHES_BYTES", -1)
    b = oracles.random_moments(np.random.default_rng(pixels), 3, pixels).astype(np.complex64)
    c = tm.levinson(b)
    phase_rad = PHASES[kind](phases)
    room = np.full(phases * pixels + 128, -1, np.float32)

    for offset in (3, 16, 31):  # wherever memory begins
        out = room[offset : offset + phases * pixels].reshape(phases, pixels)
        out[:] = np.nan
        kernel("density", c.polynomial)(c.polynomial, c.reflection, c.error, phase_rad, out)

        with without_kernels():
            assert np.allclose(out, tm.density(c, phase_rad), rtol=1e-3)
        whole = out.copy()
        out[:] = np.nan
        kernel("density", c.polynomial)(
            c.polynomial, c.reflection, c.error, phase_rad, out, spread=last_part_first
        )
        assert np.array_equal(out, whole)
        out[:] = -1
        assert (room == -1).all(), "something was written outside"


@pytest.mark.parametrize("alike", [1, 2, 4, 16])
@pytest.mark.parametrize("phases", [1, 2, 3, 7, 8, 9, 12, 31, 64])
@pytest.mark.parametrize("kind", PHASES)
def test_every_phase_is_in_a_group_of_rows_that_begin_alike(
    phases: int, alike: int, kind: str
) -> None:
    phase_rad = PHASES[kind](phases)

    groups = phase_groups.grouping(3, "d")(phase_rad, alike)

    size = 4 if groups.together == phase_groups.TURN else 2
    rows = groups.rows[:, :size]
    assert sorted(np.unique(rows)) == list(range(phases))
    assert len(rows) <= phases // size + alike
    assert ((rows - rows[:, :1]) % alike == 0).all()
    centre = np.arctan2(groups.centre[3], groups.centre[0])
    angle = np.arctan2(groups.waves[:, 3], groups.waves[:, 0]) + centre
    assert np.allclose(np.exp(1j * angle), np.exp(1j * phase_rad[rows[:, 0]]))


@pytest.mark.parametrize(
    ("kind", "phases", "alike", "together"),
    [
        ("any", 64, 1, phase_groups.ANY),
        ("equidistant", 7, 1, phase_groups.ANY),
        ("equidistant", 64, 2, phase_groups.MIRRORED),
        ("equidistant", 64, 4, phase_groups.ANY),
        ("turn", 66, 2, phase_groups.MIRRORED),
        ("turn", 64, 2, phase_groups.TURN),
        ("turn back", 64, 1, phase_groups.TURN),
    ],
)
def test_phases_are_evaluated_together_as_far_as_they_are_symmetric(
    kind: str, phases: int, alike: int, together: int
) -> None:
    groups = phase_groups.grouping(3, "f")(PHASES[kind](phases), alike)

    assert groups.together == together
    rows, phase_rad = groups.rows, PHASES[kind](phases)
    if together != phase_groups.ANY:
        pair_rad = phase_rad[rows[:, :2]]
        centre = np.exp(1j * np.arctan2(groups.centre[3], groups.centre[0]))
        paired = rows[:, 0] != rows[:, 1]
        assert np.allclose(np.exp(1j * pair_rad[paired].sum(axis=1)), centre**2, atol=1e-6)
    if together == phase_groups.TURN:
        opposite = np.exp(1j * phase_rad[rows[:, 2:]]) / np.exp(1j * phase_rad[rows[:, :2]])
        assert np.allclose(opposite, -1)


def test_no_phases_give_an_empty_density() -> None:
    c = tm.levinson(varied_moments(3, np.complex64))

    assert tm.density(c, np.zeros(0)).shape == (0, 1003)


@pytest.mark.parametrize("m", ORDERS)
def test_single_precision_returns_reproduce_their_moments(m: int) -> None:
    b = varied_moments(m, np.complex64, pixels=4001)

    phase, weight, uniform, count = kernel("pisarenko", b)(b)

    wide = (part.astype(float) for part in (phase, weight, uniform))
    error = size(residual(b.astype(complex), *wide), b)
    assert error.max() < 32 * (m + 1) * eps(b)
    assert ((phase >= 0) & (phase < 2 * np.pi)).all(where=weight > 0)
    assert np.isnan(phase[weight == 0]).all()
    assert np.array_equal(count, (weight > 0).sum(axis=0))
    assert (np.diff(np.where(weight > 0, phase, 7), axis=0) >= 0).all()


@pytest.mark.parametrize("m", ORDERS)
def test_double_precision_returns_reproduce_their_moments(m: int) -> None:
    b = varied_moments(m, np.complex128)

    phase, weight, uniform, _ = kernel("pisarenko", b)(b)

    error = size(residual(b, phase, weight, uniform), b)
    assert error.max() < 32 * (m + 1) * eps(b)


@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("m", ORDERS)
def test_well_separated_returns_are_those_of_the_planar_statement(m: int, dtype: type) -> None:
    phase, weight = oracles.random_returns(
        np.random.default_rng(m), returns=m, pixels=500, apart_rad=4 / m
    )
    b = oracles.moments_of_returns(phase, weight, m)
    b[0] += 0.1 * b[0].real
    b = b.astype(dtype)

    found = tm.Returns(*kernel("pisarenko", b)(b))

    with without_kernels():
        planar = tm.pisarenko(b)
    assert np.abs(found.phase_rad - planar.phase_rad).max() < 1e4 * eps(b)
    assert np.abs(found.weight / b[0].real - planar.weight / b[0].real).max() < 1e4 * eps(b)
    assert np.array_equal(found.count, planar.count)
    assert np.abs(found.phase_rad - phase).max() < 1e4 * eps(b)


@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("returns", [1, 2])
@pytest.mark.parametrize("m", ORDERS)
def test_fewer_returns_than_harmonics_are_counted(m: int, returns: int, dtype: type) -> None:
    phase, weight = oracles.random_returns(
        np.random.default_rng(m), returns=returns, pixels=300, apart_rad=1.0
    )
    b = oracles.moments_of_returns(phase, weight, m)
    b[0] += 0.05
    b = b.astype(dtype)

    found = tm.Returns(*kernel("pisarenko", b)(b))

    assert (found.count == returns).all()
    assert np.abs(found.phase_rad[:returns] - phase).max() < 1e4 * eps(b)
    assert np.abs(found.weight[:returns] - weight).max() < 1e4 * eps(b)
    assert (found.weight[returns:] == 0).all()
    assert np.isnan(found.phase_rad[returns:]).all()


@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("m", ORDERS)
def test_returns_of_special_pixels_follow_the_planar_statement(m: int, dtype: type) -> None:
    b, where = special_moments(m, dtype)

    found = tm.Returns(*kernel("pisarenko", b)(b))

    with without_kernels():
        planar = tm.pisarenko(b)
    for kind in ("zero", "uniform", "NaN in b_0", "NaN in b_m", "infinite b_1"):
        pixels = where[kind]
        assert (found.count[pixels] == 0).all(), kind
        assert (found.weight[:, pixels] == 0).all(), kind
        assert np.isnan(found.phase_rad[:, pixels]).all(), kind
        assert np.array_equal(np.isnan(found.uniform[pixels]), np.isnan(planar.uniform[pixels])), (
            kind
        )
    for kind in ("negative b_0", "no b_0", "huge", "tiny"):
        pixels = where[kind]
        scale = np.abs(b[:, pixels]).max(axis=0)
        total = found.weight[:, pixels].sum(axis=0), planar.weight[:, pixels].sum(axis=0)
        assert np.abs(total[0] / scale - total[1] / scale).max() < 1e3 * eps(b), kind
    usual = np.ones(b.shape[1], bool)
    for pixels in where.values():
        usual[pixels] = False
    assert np.isfinite(found.weight[:, usual]).all(), "a special pixel disturbed its neighbours"


@pytest.mark.parametrize("m", ORDERS)
def test_a_known_eigenvalue_is_taken(m: int) -> None:
    b = varied_moments(m, np.complex64)
    eigenvalue = kernel("smallest_eigenvalue", b)(b)

    searched, known = kernel("pisarenko", b)(b), kernel("pisarenko", b)(b, eigenvalue)

    for first, second in zip(searched, known, strict=True):
        assert np.array_equal(first, second, equal_nan=True)


def test_pixels_that_single_precision_is_not_enough_for_are_redone() -> None:
    b = varied_moments(3, np.complex64, pixels=4001)
    phase, weight, uniform, _ = kernel("pisarenko", b)(b)

    wide = (part.astype(float) for part in (phase, weight, uniform))
    assert size(residual(b.astype(complex), *wide), b).max() < 32 * 4 * eps(b)


@pytest.mark.parametrize("name", ["smallest_eigenvalue", "levinson", "pisarenko"])
@pytest.mark.parametrize("pixels", [64, 65, 127, 300])
def test_every_number_of_pixels_gives_the_same_results(name: str, pixels: int) -> None:
    """The last pixels share a register with some that were done already."""
    b = varied_moments(3, np.complex64)

    whole, part = kernel(name, b)(b), kernel(name, b)(b[:, :pixels])

    whole, part = (x if isinstance(x, tuple) else (x,) for x in (whole, part))
    for of_all, of_some in zip(whole, part, strict=True):
        assert np.array_equal(of_all[..., :pixels], of_some, equal_nan=True)


@pytest.mark.parametrize("name", ["smallest_eigenvalue", "levinson", "pisarenko"])
def test_results_have_the_shape_of_any_pixels(name: str) -> None:
    b = varied_moments(3, np.complex64, pixels=1020)
    strided = np.moveaxis(b.reshape(4, 4, 255).copy(), 1, 2)

    found, expected = kernel(name, b)(strided), kernel(name, b)(b)

    found, expected = (x if isinstance(x, tuple) else (x,) for x in (found, expected))
    for one, other in zip(found, expected, strict=True):
        rearranged = np.moveaxis(one, -1, -2).reshape(other.shape)
        assert np.array_equal(rearranged, other, equal_nan=True)


@pytest.mark.parametrize("parts", [1, 2, 3, 7])
def test_several_threads_give_the_same_results(parts: int) -> None:
    b = varied_moments(3, np.complex64, pixels=9005)
    c = tm.Coefficients(*kernel("levinson", b)(b))
    phase_rad = np.linspace(0, 6, 9)
    with ThreadPoolExecutor(3) as executor:
        spread = tm.kernels.over(executor, parts)
        many = [
            *kernel("levinson", b)(b, spread=spread),
            *kernel("pisarenko", b)(b, spread=spread),
            kernel("smallest_eigenvalue", b)(b, spread=spread),
            kernel("density", b)(c.polynomial, c.reflection, c.error, phase_rad, spread=spread),
        ]
    one = [
        *c,
        *kernel("pisarenko", b)(b),
        kernel("smallest_eigenvalue", b)(b),
        kernel("density", b)(c.polynomial, c.reflection, c.error, phase_rad),
    ]
    for first, second in zip(one, many, strict=True):
        assert np.array_equal(first, second, equal_nan=True)


@pytest.mark.parametrize("total", [1, 64, 1023, 1024, 2047, 2048, 5000, 19560, 307200])
@pytest.mark.parametrize("parts", [1, 2, 3, 16])
def test_parts_cover_every_pixel_once(total: int, parts: int) -> None:
    seen: list[tuple[int, int]] = []
    with ThreadPoolExecutor(2) as executor:
        tm.kernels.over(executor, parts)(lambda *part: seen.append(part), total)

    seen.sort()
    assert [begin for begin, _ in seen] == [0, *(end for _, end in seen[:-1])]
    assert seen[-1][1] == total
    assert len(seen) <= (parts if total < LARGE else max(parts, -(-total // BLOCK)))
    assert all(end - begin >= min(total, 1024) for begin, end in seen)


@pytest.mark.parametrize("total", [64, 100, 19560, 307200])
@pytest.mark.parametrize("each", [1, 4])
def test_an_image_is_cut_into_as_many_parts_as_asked_for_each_thread(total: int, each: int) -> None:
    seen: list[tuple[int, int]] = []
    with ThreadPoolExecutor(1) as executor:
        tm.kernels.over(executor, 2)(lambda *part: seen.append(part), total, 64, each)

    seen.sort()
    assert [begin for begin, _ in seen] == [0, *(end for _, end in seen[:-1])]
    assert seen[-1][1] == total
    assert min(end - begin for begin, end in seen) >= 64
    assert total >= LARGE or len(seen) == min(2 * each, total // 64)


def test_threads_hold_nothing_of_an_image_that_is_done() -> None:
    """The memory of its results would come back late, and the next image take other memory."""

    kept: list[object] = []

    class Keeping(ThreadPoolExecutor):
        """Holds for good what its threads hold until they run again."""

        def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
            kept.append((fn, args, kwargs))
            return super().submit(fn, *args, **kwargs)

    def fill(begin: int, end: int, filled: Array) -> None:
        filled[begin:end] = 1.0

    result = np.zeros(5000)
    gone = weakref.ref(result)
    with Keeping(1) as executor:
        spread = tm.kernels.over(executor, 2)
        spread(partial(fill, filled=result), 5000)
        assert result.all()
        assert kept
        del result
        assert gone() is None


@pytest.mark.parametrize("total", [19560, 307200])
def test_no_image_waits_for_threads_that_have_other_work(total: int) -> None:
    seen: list[tuple[int, int]] = []
    idle = threading.Event()
    with ThreadPoolExecutor(1) as executor:
        executor.submit(idle.wait)
        tm.kernels.over(executor, 2)(lambda *part: seen.append(part), total)
        idle.set()

    assert sum(end - begin for begin, end in seen) == total


@pytest.mark.parametrize("stop", [1, 64, 16384, 16385, 24576, 24577, 307200])
def test_blocks_cover_every_pixel_once_and_none_is_tiny(stop: int) -> None:
    cuts = list(blocks(0, stop))

    assert cuts[0][0] == 0
    assert cuts[-1][1] == stop
    assert all(end == begin for (_, end), (begin, _) in itertools.pairwise(cuts))
    assert min(end - begin for begin, end in cuts) >= min(stop, 64)


@pytest.mark.parametrize("zeroth", ["low-frequency", "on-off", "estimated"])
@pytest.mark.parametrize("m", ORDERS)
def test_raw_images_are_measured_as_by_the_planar_statement(m: int, zeroth: str) -> None:
    images = 4 * m + {"low-frequency": 4, "on-off": 2, "estimated": 0}[zeroth]
    raw = np.random.default_rng(m).integers(0, 65536, (images, 23, 37)).astype(np.uint16)

    found = tm.measure(raw, zeroth=zeroth)

    with without_kernels():
        planar = tm.measure(raw, zeroth=zeroth)
    assert found.dtype == planar.dtype
    assert np.allclose(found, planar, rtol=1e-6)


def test_takes_are_averaged_by_the_planar_statement() -> None:
    raw = np.random.default_rng(0).integers(0, 4096, (3, 16, 9, 40)).astype(np.uint16)

    found = tm.measure(raw.reshape(48, 9, 40), zeroth="low-frequency", takes=3)

    with without_kernels():
        planar = tm.measure(raw.reshape(48, 9, 40), zeroth="low-frequency", takes=3)
    assert np.array_equal(found, planar)


@pytest.mark.parametrize("sigma_px", [0.3, 0.6, 2.5])
@pytest.mark.parametrize("shape", [(1, 64), (3, 32), (23, 37), (60, 81)])
def test_images_are_smoothed_as_by_the_planar_statement(
    shape: tuple[int, int], sigma_px: float
) -> None:
    b = varied_moments(3, np.complex64, pixels=5000)[:, : shape[0] * shape[1]]
    b = b.reshape(4, *shape)

    found = tm.smooth(b, sigma_px)

    with without_kernels():
        planar = tm.smooth(b, sigma_px)
    assert found.dtype == planar.dtype
    assert np.abs(found - planar).max() < 1e-6 * np.abs(b).max()


def test_a_pixel_that_is_not_finite_counts_as_nothing_for_its_neighbours() -> None:
    b = varied_moments(3, np.complex64, pixels=1000).reshape(4, 25, 40)
    b[2, 7, 9], b[0, 0, 39] = np.nan, np.inf

    found = tm.smooth(b)

    with without_kernels():
        assert np.array_equal(found, tm.smooth(b), equal_nan=True)
    assert np.isfinite(found).all(axis=0).sum() == 998


@pytest.mark.parametrize("shape", [(4, 40, 20), (4, 300), (2, 4, 25, 40)])
def test_images_no_kernel_takes_are_smoothed_all_the_same(shape: tuple[int, ...]) -> None:
    if len(shape) < 3:
        shape = (*shape[:1], 10, shape[1] // 10)
    b = np.random.default_rng(0).normal(size=shape).astype(np.complex64)

    found = tm.smooth(b)

    with without_kernels():
        assert np.array_equal(found, tm.smooth(b))


@pytest.mark.parametrize("threshold", [0.0, 0.1, 0.7, 1.0])
@pytest.mark.parametrize("m", ORDERS)
def test_light_is_separated_as_by_the_planar_statement(m: int, threshold: float) -> None:
    b, _ = special_moments(m, np.complex64)
    returns = tm.pisarenko(b)

    found = tm.separate(returns, threshold)

    with without_kernels():
        planar = tm.separate(returns, threshold)
    for one, other in zip(found, planar, strict=True):
        assert one.dtype == other.dtype
        assert np.allclose(one, other, rtol=1e-5, atol=1e-37, equal_nan=True)
