"""The planar statements are tested as they stand, whatever lanes another test has compiled."""

import pytest

from transientcam_moments._dispatch import KERNELS


@pytest.fixture(autouse=True)
def planar_statements(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Hide the compiled lanes from all tests but the lanes' own."""
    if "kernels" not in request.module.__name__:
        monkeypatch.setattr(KERNELS, "compiled", {})
