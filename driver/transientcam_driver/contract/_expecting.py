"""Words for what a camera has to do."""

from typing import Any

from transientcam_driver.errors import DriverError


class ContractBroken(DriverError):
    """A camera does not do what every `Camera` promises."""


class ContractSkipped(DriverError):
    """A promise that this camera offers no way to try."""


class raises:
    """Around what has to raise an error."""

    def __init__(self, expected: type[DriverError], what: str) -> None:
        self._expected = expected
        self._what = what
        self.error: Any = None

    def __enter__(self) -> "raises":
        return self

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> bool:
        if isinstance(error, self._expected):
            self.error = error
            return True
        if error is None:
            raise ContractBroken(f"{self._what} does not raise {self._expected.__name__}")
        if isinstance(error, Exception):
            raise ContractBroken(f"{self._what} raises {error!r}") from error
        return False


def require(kept: bool, otherwise: str) -> None:
    """Raise `ContractBroken` unless a promise is kept."""
    if not kept:
        raise ContractBroken(otherwise)
