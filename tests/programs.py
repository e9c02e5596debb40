"""Programs of others that some tests run."""

import shutil

import pytest

needs_octave = pytest.mark.skipif(
    shutil.which("octave-cli") is None, reason="GNU Octave is not installed"
)
