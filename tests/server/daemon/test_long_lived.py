import gc
import threading
from collections.abc import Iterator

import pytest

from transientcam_server.daemon.server import freeze_startup_objects


@pytest.fixture(autouse=True)
def as_before() -> Iterator[None]:
    """Leave the collector of the tests as it was."""
    yield
    gc.unfreeze()


class Node:
    """Something that refers to itself."""

    def __init__(self) -> None:
        self.itself = self


def test_what_is_there_is_passed_over_and_what_the_compiler_leaves_too() -> None:
    finish = threading.Event()
    left: list[Node] = []

    def compile_() -> None:
        finish.wait()
        left.extend(Node() for _ in range(100))

    compiling = threading.Thread(target=compile_)
    compiling.start()
    waiting = freeze_startup_objects(compiling)
    before = gc.get_freeze_count()
    finish.set()
    waiting.join()

    assert before > 1000
    assert gc.get_freeze_count() >= before + 100
    frozen = {id(each) for each in gc.get_objects()}
    assert not any(id(each) in frozen for each in left)


def test_garbage_that_comes_later_is_still_found() -> None:
    done = threading.Thread(target=lambda: None)
    done.start()
    freeze_startup_objects(done).join()
    for _ in range(10):
        Node()

    assert gc.collect() >= 10
