"""Iterations over planes: NumPy stops early and lets finished pixels go, JAX runs a while loop."""

from collections.abc import Callable
from typing import Any

import numpy as np

from transientcam_moments.arrays._planes import Array, namespace

State = tuple[Array, ...]

# After these applications finished pixels are let go. The steps are the same for all pixels, so
# that the result of none depends on how its neighbours fare.
_RELEASES = frozenset((4, 5, 6, 7, 8, 10, 12, 14, 17, 20, 24, 29, 35, 42, 50, 60, 80, 100))


def repeat(
    body: Callable[[State], State],
    state: State,
    *,
    times: int,
    done: Callable[[State], Array],
) -> State:
    """Apply `body` until every pixel is done, at most `times` times.

    Parameters
    ----------
    body : callable
        Takes and returns the state, a tuple of planes, pixel by pixel.
    state : tuple of array, shape (P)
        What it starts from.
    times : int
        Most applications.
    done : callable
        Takes the state, returns a boolean plane. A pixel that is done may or may not be iterated
        further; its result must stay valid if it is.

    Returns
    -------
    tuple of array
        The state of every pixel after its last application.
    """
    if isinstance(state[-1], np.ndarray):
        return _repeat_numpy(body, state, times, done)
    if namespace(state[-1]).__name__ == "jax.numpy":
        return _repeat_jax(body, state, times, done)
    for _ in range(times):
        state = body(state)
        if bool(done(state).all()):
            break
    return state


def _repeat_numpy(
    body: Callable[[State], State], state: State, times: int, done: Callable[[State], Array]
) -> State:
    results: list[np.ndarray[Any, Any]] = []
    active: Any = slice(None)
    for step in range(1, times + 1):
        state = body(state)
        if step != times and step not in _RELEASES:
            continue
        finished = done(state)
        if step != times and not finished.any():
            continue
        if not results:  # all pixels are still there
            results = [np.array(part) for part in state]
        for result, part in zip(results, state, strict=True):
            result[active] = part
        keep = np.flatnonzero(~finished)
        if not keep.size:
            break
        active = keep if isinstance(active, slice) else active[keep]
        state = tuple(part[keep] for part in state)
    return tuple(results)


def _repeat_jax(
    body: Callable[[State], State], state: State, times: int, done: Callable[[State], Array]
) -> State:
    from jax import lax

    def more(carry: tuple[Any, State]) -> Any:
        step, inner = carry
        return (step < times) & ~done(inner).all()

    def advance(carry: tuple[Any, State]) -> tuple[Any, State]:
        step, inner = carry
        return step + 1, body(inner)

    return lax.while_loop(more, advance, (0, state))[1]
