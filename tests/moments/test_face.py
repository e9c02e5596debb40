"""What the package shows."""

import inspect
import subprocess
import sys

import transientcam_moments as tm


def test_the_list_of_public_names_is_sorted_and_complete() -> None:
    # constants, classes, functions, each by the alphabet: the order the linter keeps
    assert tm.__all__ == sorted(tm.__all__, key=lambda name: (not name.isupper(), name))
    public = {name for name, value in vars(tm).items() if not name.startswith("_")}
    submodules = {name for name in public if inspect.ismodule(getattr(tm, name))}
    assert set(tm.__all__) - submodules == public - submodules
    assert all(hasattr(tm, name) for name in tm.__all__)


def test_every_public_function_says_what_it_does() -> None:
    assert [name for name in tm.__all__ if not getattr(tm, name).__doc__] == []


def test_importing_it_imports_no_compiler_and_no_jax() -> None:
    code = (
        "import sys, transientcam_moments;"
        "print(sorted({'jax', 'numba', 'scipy', 'matplotlib'} & set(sys.modules)))"
    )

    printed = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )

    assert printed.stdout.strip() == "[]"
