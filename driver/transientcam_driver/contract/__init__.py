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


CLAUSES: Final = tuple(
    Clause(name.replace("_", "-"), inspect.getdoc(each) or "", each)
    for name, each in vars(clauses).items()
    if inspect.isfunction(each) and each.__module__ == clauses.__name__ and name[0] != "_"
)
"""Every public function of the file of clauses, in the order in which they stand there."""
