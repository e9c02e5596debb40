import doctest
import importlib
import pkgutil

import pytest

import transientcam_driver

ENTRY_POINTS = {"transientcam_driver.cli", "transientcam_simulation.entries"}
PACKAGES = [
    each.name
    for each in pkgutil.walk_packages(transientcam_driver.__path__, "transientcam_driver.")
    if each.ispkg and each.name not in ENTRY_POINTS
]


def test_public_names_are_sorted_complete_and_there() -> None:
    assert transientcam_driver.__all__ == sorted(transientcam_driver.__all__)
    assert all(hasattr(transientcam_driver, name) for name in transientcam_driver.__all__)
    assert {"Camera", "Sequence", "RawFrame", "Simulation", "Truth", "open_camera"} <= set(
        transientcam_driver.__all__
    )


@pytest.mark.parametrize("name", PACKAGES)
def test_each_package_offers_a_few_names(name: str) -> None:
    package = importlib.import_module(name)

    assert 3 <= len(package.__all__) <= 8
    assert all(hasattr(package, each) for each in package.__all__)


def test_the_example_at_the_top_runs() -> None:
    assert doctest.testmod(transientcam_driver).failed == 0
