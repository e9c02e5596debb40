"""The grids of sequences: named ones, and files."""

from pathlib import Path

import pytest

from transientcam_driver import Sequence, SequenceError
from transientcam_experiments import tradeoff
from transientcam_server.errors import InputError


def test_named_grids_hold_the_papers_settings() -> None:
    paper = tradeoff.load_grid("paper").sequences

    assert Sequence(harmonics=3, zeroth="estimated", exposure_s=0.0005) in paper  # Sec. 6.3
    assert Sequence(harmonics=4, takes=20) in paper  # Fig. 8b
    assert Sequence(harmonics=4, takes=40) in paper  # Fig. 10
    assert len(set(paper)) == len(paper)


def test_a_file_lists_sequences_and_lists_in_it_stand_for_each_of_their_values(
    tmp_path: Path,
) -> None:
    file = tmp_path / "grid.toml"
    file.write_text(
        "bins = [32]\n[[sequence]]\nharmonics = [3, 4]\ntakes = [1, 5]\n"
        "[[sequence]]\nharmonics = 8\n"
        'base_frequency_hz = 11.5e6\nsub_phases = {scheme = "none", n = 1}\n'
    )

    grid = tradeoff.load_grid(str(file))

    assert grid.bins == (32,)
    assert [(each.harmonics, each.takes) for each in grid.sequences] == [
        (3, 1),
        (3, 5),
        (4, 1),
        (4, 5),
        (8, 1),
    ]
    assert grid.sequences[-1].sub_phases.scheme == "none"


@pytest.mark.parametrize(
    ("content", "error", "named"),
    [
        (None, InputError, "grid"),
        ("[[sequence", InputError, "TOML"),
        ("bins = [3]", InputError, "sequence"),
        ("bins = [0]\n[[sequence]]\nharmonics = 3", InputError, "bins"),
        ("[[sequence]]\nharmonics = [3, 99]", SequenceError, "harmonics"),
        ("[[sequence]]\nharmoniks = 3", SequenceError, "harmoniks"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_by_name(
    tmp_path: Path, content: str | None, error: type[Exception], named: str
) -> None:
    file = tmp_path / "grid.toml"
    if content is not None:
        file.write_text(content)

    with pytest.raises(error, match=named):
        tradeoff.load_grid(str(file))
