"""The PLL of an OPT8241: the SDK's choice, by the settings that it makes of known frequencies."""

import pytest

from transientcam_opt8241 import PllSetting


@pytest.mark.parametrize(
    ("megahertz", "post_divider", "m", "fraction", "off_hz"),
    [
        (12.5, 6, 14, 38229, -4),
        (25, 3, 16, 43690, -15),
        (37.5, 2, 18, 49152, 0),
        (50, 1, 16, 43690, -31),
        (62.5, 1, 20, 54613, -15),
        (75, 1, 25, 0, 0),
        (87.5, 0, 14, 38229, -31),
        (100, 0, 16, 43690, -61),
    ],
)
def test_multiples_of_12_5_mhz_with_four_quads(
    megahertz: float, post_divider: int, m: int, fraction: int, off_hz: int
) -> None:
    found = PllSetting.of(megahertz * 1e6, 4)

    assert found == PllSetting(m, fraction, post_divider)
    assert found.frequency_hz(4) - megahertz * 1e6 == pytest.approx(off_hz, abs=1)


@pytest.mark.parametrize(
    ("multiple", "post_divider", "vco_mhz"),
    list(
        zip(
            range(1, 9), (4, 2, 1, 1, 0, 0, 0, 0), (375, 450, 450, 600, 375, 450, 525, 600),
            strict=True,
        )
    ),
)  # fmt: skip
def test_multiples_of_12_5_mhz_are_exact_with_six_quads(
    multiple: int, post_divider: int, vco_mhz: int
) -> None:
    found = PllSetting.of(multiple * 12.5e6, 6)

    assert found.post_divider == post_divider
    assert (found.m + found.fraction / 65536) * 24 == vco_mhz
    assert found.frequency_hz(6) == multiple * 12.5e6


@pytest.mark.parametrize("quads", [4, 6])
def test_every_frequency_is_met_within_a_step_of_the_fraction(quads: int) -> None:
    for frequency_hz in range(10_000_000, 100_000_001, 1_234_567):
        found = PllSetting.of(frequency_hz, quads)

        vco_hz = found.frequency_hz(quads) * quads * (1 + found.post_divider)
        assert 299.9e6 < vco_hz <= 600e6
        assert -24e6 / 65536 / quads < found.frequency_hz(quads) - frequency_hz <= 0
