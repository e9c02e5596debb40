"""Where compiled code is kept between processes."""

import hashlib
import tempfile
from collections.abc import Mapping
from pathlib import Path


def cache_directory(environ: Mapping[str, str], digest: str) -> Path | None:
    """Return a directory to keep compiled code in, which exists and can be written to.

    ``NUMBA_CACHE_DIR`` where the user has set it, else ``transientcam/kernels`` in the user's cache
    directory (XDG). ``digest`` names a directory below that: numba notices a change of the file
    that a kernel is in, but not of the files whose functions it is made of. None where nothing can
    be written to, as with a read-only home directory; a name in a directory that others can write
    to is never used, for they could put code there.
    """
    chosen = environ.get("NUMBA_CACHE_DIR")
    if chosen:
        bases = [Path(chosen)]
    else:
        bases = [Path(base) for base in (environ.get("XDG_CACHE_HOME"),) if base]
        home = environ.get("HOME") or environ.get("USERPROFILE")
        bases += [Path(home) / ".cache"] if home else []
        bases = [base / "transientcam" / "kernels" for base in bases if base.is_absolute()]
    for base in bases:
        directory = base / digest
        if _writable(directory):
            return directory
    return None


def digest_of_sources() -> str:
    """Return a short digest of every source file: kernels are made of what many of them state."""
    digest = hashlib.sha256()
    package = Path(__file__).parents[1]
    for file in sorted(package.rglob("*.py")):
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


def _writable(directory: Path) -> bool:
    try:
        directory.mkdir(parents=True, exist_ok=True, mode=0o700)
        tempfile.TemporaryFile(dir=directory).close()
    except OSError:
        return False
    return True
