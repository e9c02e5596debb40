"""Memory of results that is used again, and never while an array refers to it."""

import gc
import threading
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_compiled._memory import LEAST_BYTES, Pool

SHAPE = (2, LEAST_BYTES)


def address(array: NDArray[Any]) -> int:
    return int(array.__array_interface__["data"][0])


@pytest.mark.parametrize("dtype", ["u1", "i4", "f4", "f8", "c8"])
def test_an_array_is_like_one_of_numpy(dtype: str) -> None:
    array = Pool().empty(SHAPE, dtype)
    assert array.shape == SHAPE
    assert array.dtype == np.dtype(dtype)
    assert array.flags.c_contiguous
    assert array.flags.writeable
    assert array.flags.aligned
    array[:] = 1
    assert np.array_equal(array, np.ones(SHAPE, dtype))


def test_memory_that_an_array_has_left_is_used_again() -> None:
    pool = Pool()
    first = pool.empty(SHAPE, np.float32)
    before = address(first)
    del first
    assert pool.size_bytes == 8 * LEAST_BYTES
    # another type of the same size
    assert address(pool.empty(SHAPE[::-1], np.int32)) == before


def test_memory_stays_with_the_last_view_of_an_array() -> None:
    pool = Pool()
    array = pool.empty(SHAPE, np.float32)
    view = array.reshape(-1)[5:][::2].view(np.int32)
    array[:] = 7
    expected = view.copy()
    del array
    assert pool.size_bytes == 0
    other = pool.empty(SHAPE, np.float32)
    other[:] = 9
    np.testing.assert_array_equal(view, expected)
    del view
    assert pool.size_bytes == 8 * LEAST_BYTES


def test_memory_of_another_size_is_not_taken() -> None:
    pool = Pool()
    pool.empty(SHAPE, np.float32)
    larger = pool.empty(SHAPE, np.float64)
    assert larger.nbytes == 16 * LEAST_BYTES
    assert pool.size_bytes == 8 * LEAST_BYTES


def test_prepared_memory_is_what_arrays_of_its_size_take() -> None:
    pool = Pool()
    pool.prepare([2 * LEAST_BYTES, LEAST_BYTES, 2 * LEAST_BYTES])
    assert pool.size_bytes == 5 * LEAST_BYTES
    arrays = [pool.empty(SHAPE, np.uint8), pool.empty(SHAPE, np.uint8)]
    assert pool.size_bytes == LEAST_BYTES
    for array in arrays:
        array[:] = 1


def test_what_is_kept_is_not_prepared_again_nor_what_is_never_kept() -> None:
    pool = Pool(most_bytes=4 * LEAST_BYTES)
    pool.empty(SHAPE, np.uint8)
    pool.prepare([2 * LEAST_BYTES, LEAST_BYTES - 1, 5 * LEAST_BYTES])
    assert pool.size_bytes == 2 * LEAST_BYTES


def test_no_more_is_kept_than_stated_and_the_newest_of_it() -> None:
    pool = Pool(most_bytes=3 * LEAST_BYTES)
    arrays = [pool.empty(LEAST_BYTES, np.uint8) for _ in range(5)]
    addresses = [address(array) for array in arrays]
    while arrays:
        arrays.pop(0)
    assert pool.size_bytes == 3 * LEAST_BYTES
    kept = [pool.empty(LEAST_BYTES, np.uint8) for _ in range(3)]
    assert [address(array) for array in kept] == addresses[:1:-1]


def test_what_is_larger_than_all_that_is_kept_goes_back() -> None:
    pool = Pool(most_bytes=LEAST_BYTES)
    pool.empty(SHAPE, np.uint8)
    assert pool.size_bytes == 0


def test_what_is_larger_than_all_that_is_kept_drives_nothing_out() -> None:
    pool = Pool(most_bytes=2 * LEAST_BYTES)
    before = address(pool.empty(LEAST_BYTES, np.uint8))

    pool.empty(3 * LEAST_BYTES, np.uint8)

    assert pool.size_bytes == LEAST_BYTES
    assert address(pool.empty(LEAST_BYTES, np.uint8)) == before


def test_small_arrays_are_left_to_numpy() -> None:
    pool = Pool()
    pool.empty(LEAST_BYTES - 1, np.uint8)
    pool.empty((), np.float32)
    assert pool.size_bytes == 0


def test_memory_of_garbage_comes_back_when_it_is_collected() -> None:
    pool = Pool()
    cycle: list[object] = [pool.empty(SHAPE, np.float32)]
    cycle.append(cycle)
    del cycle
    gc.collect()
    assert pool.size_bytes == 8 * LEAST_BYTES


def test_no_call_waits_for_another_thread() -> None:
    pool = Pool()
    array = pool.empty(SHAPE, np.float32)
    with pool._lock:
        del array  # would deadlock here
        other = pool.empty(SHAPE, np.float32)
    assert pool.size_bytes == 0
    del other
    assert pool.size_bytes == 8 * LEAST_BYTES


def test_threads_never_share_memory() -> None:
    pool = Pool()
    wrong: list[int] = []

    def work(number: int) -> None:
        for _ in range(200):
            array = pool.empty(SHAPE, np.uint8)
            array[:] = number
            copy = array[:, ::1024].copy()
            if not (copy == number).all():
                wrong.append(number)

    threads = [threading.Thread(target=work, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong
    assert pool.size_bytes == sum(block.nbytes for block in pool._blocks)
