"""Iterations over planes: NumPy stops early and lets finished pixels go, JAX runs a while loop."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from transientcam_moments.arrays._planes import namespace

State = tuple[Any, ...]
"""Planes and banks of planes."""

Step = Callable[[bool, State, State, State], State]

# After these steps finished pixels are let go.
_RELEASES = frozenset((4, 5, 6, 7, 8, 10, 12, 14, 17, 20, 24, 29, 35, 42, 50, 60, 80, 100))


def repeat(
    body: Step, steps: int, fixed: State, given: State, state: State, *, alike: bool = False
) -> State:
    """Apply ``state = body(first, fixed, given, state)`` until no pixel moves.

    Parameters
    ----------
    body : callable
        A step, pixel by pixel; ``first`` says whether it is the first one. It must leave a pixel
        as it is that does not move: how long its neighbours take decides how often it is applied.
        It may change the banks of the state.
    steps : int
        Most applications.
    fixed : tuple
        What is no plane of pixels: lengths, tables.
    given : tuple
        Planes, and banks of planes, that stay as they are.
    state : tuple
        What it starts from: the mask of the pixels that move, then planes and banks. The banks may
        be changed.
    alike : bool
        Whether the first step is as the others are: ``first`` doesn't matter to the body.

    Returns
    -------
    tuple
        The state after the last step.
    """
    if isinstance(state[0], np.ndarray):
        return _repeat_numpy(body, steps, fixed, given, state)
    if namespace(state[0]).__name__ == "jax.numpy":
        return _repeat_jax(body, steps, fixed, given, state)
    own = getattr(namespace(state[0]), "iterate", None)  # of what isn't computed here
    if own is not None:
        found: State = own(body, steps, fixed, given, state, alike=alike)
        return found
    for step in range(steps):
        state = body(step == 0, fixed, given, state)
        if not bool(state[0].any()):
            break
    return state


def _repeat_numpy(body: Step, steps: int, fixed: State, given: State, state: State) -> State:
    results: list[np.ndarray[Any, Any]] = []
    active: Any = slice(None)
    for step in range(1, steps + 1):
        state = body(step == 1, fixed, given, state)
        if step != steps and step not in _RELEASES:
            continue
        moving = state[0]
        if step != steps and moving.all():
            continue
        planes = list(_planes(state))
        if not results:  # all pixels are still there
            results = [np.array(plane) for plane in planes]
        for result, plane in zip(results, planes, strict=True):
            result[active] = plane
        keep = np.flatnonzero(moving)
        if not keep.size:
            break
        active = keep if isinstance(active, slice) else active[keep]
        given, state = _of_pixels(given, keep), _of_pixels(state, keep)
    return _with(state, iter(results))


def _planes(state: Any) -> Iterator[Any]:
    """Yield the planes of a state, those of its banks in their places."""
    for part in state:
        if isinstance(part, list):
            yield from part
        else:
            yield part


def _with(state: State, planes: Iterator[Any]) -> State:
    """Return a state of the same form with other planes."""
    return tuple(
        [next(planes) for _ in part] if isinstance(part, list) else next(planes) for part in state
    )


def _of_pixels(state: State, pixels: Any) -> State:
    return _with(state, (plane[pixels] for plane in _planes(state)))


def _repeat_jax(body: Step, steps: int, fixed: State, given: State, state: State) -> State:
    from jax import lax

    def more(carry: tuple[Any, State]) -> Any:
        step, inner = carry
        return (step < steps) & inner[0].any()

    def advance(carry: tuple[Any, State]) -> tuple[Any, State]:
        step, inner = carry
        return step + 1, body(False, fixed, given, inner)

    return lax.while_loop(more, advance, (1, body(True, fixed, given, state)))[1]
