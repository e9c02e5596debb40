import codecs
from pathlib import Path

import pytest

from transientcam_driver.texts import read_text

TEXT = 'camera = "sim:mirrors"\n# Messgerät\n'


@pytest.mark.parametrize("mark", [b"", codecs.BOM_UTF8])
@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_utf_8_is_read_however_its_lines_end(tmp_path: Path, mark: bytes, line_end: str) -> None:
    file = tmp_path / "a.toml"
    file.write_bytes(mark + TEXT.replace("\n", line_end).encode())

    assert read_text(file) == TEXT


@pytest.mark.parametrize(
    ("encoding", "name"),
    [
        ("utf-16", "UTF-16"),
        ("utf-16-le", "UTF-16"),
        ("utf-16-be", "UTF-16"),
        ("utf-32", "UTF-32"),
        ("latin-1", r"not UTF-8 \(byte 0xe4 in line 2\)"),
    ],
)
def test_another_encoding_is_named_with_what_to_do(
    tmp_path: Path, encoding: str, name: str
) -> None:
    file = tmp_path / "a.toml"
    file.write_bytes(TEXT.encode(encoding))

    with pytest.raises(ValueError, match=f"is {name}.*; save it as UTF-8"):
        read_text(file)
