"""One bench for all figures' tests: captures and calibrations are made once."""

import pytest

from transientcam_experiments.paper import Bench


@pytest.fixture(scope="session")
def bench() -> Bench:
    return Bench(quick=True)
