"""What importing the package gives, and what it costs."""

import subprocess
import sys

import pytest

import transientcam


def test_the_public_names_are_these() -> None:
    assert transientcam.__all__ == [
        "AsyncCamera",
        "AsyncLease",
        "AsyncStream",
        "Camera",
        "FoundCamera",
        "Frame",
        "FrameTimeout",
        "Lease",
        "MissingExtra",
        "Notice",
        "ParameterError",
        "ProblemError",
        "ProtocolError",
        "Reconnect",
        "RecordedFrame",
        "Recording",
        "ServerUnreachable",
        "Stream",
        "StreamClosed",
        "Subscription",
        "TransientcamError",
        "__version__",
        "density",
        "discover",
        "open",
        "player",
        "transient",
    ]


def test_public_names_are_sorted_and_exist() -> None:
    names = transientcam.__all__

    # as ruff sorts them: constants, then classes, then the rest
    assert (
        sorted(names, key=lambda name: (not name.isupper(), not name[:1].isupper(), name)) == names
    )
    assert all(hasattr(transientcam, name) for name in names)


@pytest.mark.parametrize(
    "heavy",
    [
        *("fastapi", "numba", "pydantic", "scipy", "typer", "usb", "uvicorn", "matplotlib"),
        "zeroconf",
    ],
)
def test_importing_the_client_does_not_import(heavy: str) -> None:
    program = f"import sys, transientcam, transientcam.wire; sys.exit({heavy!r} in sys.modules)"

    subprocess.run([sys.executable, "-c", program], check=True)
