"""Let coverage guide the bytes that the targets are given; the first one says which target.

``python -m tests.server.fuzzing.coverage_guided [options of libFuzzer] [CORPUS]`` goes on until
it is interrupted, or as long as ``-runs`` says; what it finds it writes to a file.
"""

import sys

import atheris  # type: ignore[import-untyped]  # its stubs are another package

# what is imported within is watched
with atheris.instrument_imports(
    include=["transientcam.wire", "transientcam_driver.calibration._file"]
):
    from tests.server.fuzzing.targets import TARGETS

_TARGETS = tuple(TARGETS.values())


def any_target(data: bytes) -> None:
    """Give a target all bytes but the first."""
    if data:
        _TARGETS[data[0] % len(_TARGETS)](data[1:])


def main() -> None:
    """Look for bytes that make a target raise; never returns."""
    atheris.Setup(sys.argv, any_target)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
