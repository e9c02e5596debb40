"""What every `Camera` promises, as checks that any implementation can be put through.

>>> from transientcam_driver import contract
>>> for clause in contract.CLAUSES:
...     clause.run(contract.Bench.of("sim:mirrors"))

A clause returns where the promise is kept, raises `ContractBroken` where it is not, and
`ContractSkipped` where this camera offers no way to try it. Each opens the camera and closes it.
"""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from transientcam_driver.contract import _clauses as clauses
from transientcam_driver.contract._bench import Bench
from transientcam_driver.contract._expecting import ContractBroken, ContractSkipped
from transientcam_driver.errors import DriverError

__all__ = ["CLAUSES", "Bench", "Clause", "ContractBroken", "ContractSkipped"]


@dataclass(frozen=True, slots=True)
class Clause:
    """One promise, and the function that tries it."""

    name: str
    promise: str
    attempt: Callable[[Bench], None]

    def run(self, bench: Bench) -> None:
        """Hold a camera to the promise.

        Raises
        ------
        ContractBroken
            It is not kept, or something failed that must not.
        ContractSkipped
            It cannot be tried with this camera.
        """
        try:
            self.attempt(bench)
        except (ContractBroken, ContractSkipped):
            raise
        except DriverError as error:
            raise ContractBroken(str(error)) from error


def _of(*functions: Callable[[Bench], None]) -> tuple[Clause, ...]:
    return tuple(
        Clause(each.__name__.replace("_", "-"), inspect.getdoc(each) or "", each)
        for each in functions
    )


CLAUSES: Final = _of(
    clauses.an_opened_camera_is_idle_and_dark,
    clauses.frames_are_whole_labelled_and_in_order,
    clauses.stop_is_dark_and_start_goes_on,
    clauses.stop_releases_a_waiting_reader,
    clauses.a_timeout_is_no_failure,
    clauses.an_impossible_sequence_is_refused_by_name,
    clauses.a_new_sequence_has_a_new_epoch,
    clauses.lost_images_are_counted,
    clauses.an_unplugged_camera_is_lost_and_comes_back,
    clauses.a_closed_camera_is_dark_and_free,
)
