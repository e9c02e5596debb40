import doctest

import transientcam_driver


def test_public_names_are_sorted_complete_and_there() -> None:
    assert transientcam_driver.__all__ == sorted(transientcam_driver.__all__)
    assert all(hasattr(transientcam_driver, name) for name in transientcam_driver.__all__)
    assert {"Camera", "Sequence", "RawFrame", "Simulation", "Truth", "open_camera"} <= set(
        transientcam_driver.__all__
    )


def test_the_example_at_the_top_runs() -> None:
    assert doctest.testmod(transientcam_driver).failed == 0
