"""What a pane mirrors, lets pass and delays: closed forms, and light counted face by face."""

import math

import numpy as np
import pytest

from transientcam_simulation.scene._scene import Glass

ANGLES_RAD = np.radians([0, 20, 45, math.degrees(math.atan(1.5)), 75, 89])


def test_straight_on_two_faces_mirror_one_part_in_thirteen_of_glass() -> None:
    """r = ((n - 1) / (n + 1))^2 = 0.04 by a face, and 2 r / (1 + r) by both."""
    shares = np.array(Glass(1.5, 0.004).shares(np.ones(1)))

    assert shares[:, 0] == pytest.approx([1 / 13, 12 / 13, 0.5 * 0.004])


@pytest.mark.parametrize("index", [1.0, 1.33, 1.5, 2.4])
def test_light_that_goes_to_and_fro_between_the_faces_adds_up(index: float) -> None:
    mirrored, passed = np.zeros((2, len(ANGLES_RAD)))
    inside = np.arcsin(np.sin(ANGLES_RAD) / index)
    one, other = np.cos(ANGLES_RAD), np.cos(inside)
    for amplitude in (
        (one - index * other) / (one + index * other),
        (index * one - other) / (index * one + other),
    ):
        r = amplitude**2
        mirrored += r / 2
        within = 1 - r  # of light that has come in, what now meets the back face
        for _trip in range(2000):
            passed += within * (1 - r) / 2
            mirrored += within * r * (1 - r) / 2
            within = within * r * r

    found = Glass(index, 0.01).shares(one)
    assert found[0] == pytest.approx(mirrored, abs=1e-9)
    assert found[1] == pytest.approx(passed, abs=1e-9)


def test_the_way_through_a_pane_is_that_of_snells_ray() -> None:
    """Along the ray in the glass, less what that takes off the way in air to the same front."""
    index, thick_m = 1.5, 0.02
    inside = np.arcsin(np.sin(ANGLES_RAD) / index)

    along_m = thick_m / np.cos(inside)
    longer_m = index * along_m - along_m * np.cos(ANGLES_RAD - inside)

    assert Glass(index, thick_m).shares(np.cos(ANGLES_RAD))[2] == pytest.approx(longer_m)


@pytest.mark.parametrize("reflectivity", [None, 0.0, 0.5, 1.0])
def test_dust_mirror_and_passage_share_all_light(reflectivity: float | None) -> None:
    pane = Glass(1.5, 0.004, reflectivity, dust=0.2)

    mirrored, passed, _ = pane.shares(np.cos(ANGLES_RAD))

    assert mirrored + passed == pytest.approx(np.full(len(ANGLES_RAD), 0.8))
    if reflectivity is not None:
        assert mirrored == pytest.approx(np.full(len(ANGLES_RAD), 0.8 * reflectivity))


def test_along_its_face_a_pane_mirrors_all() -> None:
    assert Glass().shares(np.array([1e-6]))[0] == pytest.approx([1.0], abs=1e-4)
