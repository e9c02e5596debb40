"""Where compiled code is kept between processes, and functions that are compiled into it.

numba itself is imported by whoever has functions to compile.
"""

import hashlib
import os
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

_ENABLING: Final = threading.Lock()


class NotKept(Exception):  # noqa: N818 - says what the cache lacks
    """A function would have to be compiled."""


class Cache:
    """What is kept of the compiled code of one library.

    numba notices a change of the file that a function is in, but not of the files whose functions
    and constants it is made of: there is a directory for each state of all these files.

    ``sources``: names of the modules, and packages of modules, that code is compiled of.
    ``environ``: in the place of the environment of the process.
    """

    def __init__(self, *sources: str, environ: Mapping[str, str] = os.environ) -> None:
        self._sources = sources
        self._environ = environ

    @cached_property
    def digest(self) -> str:
        """Short, of every file of the sources."""
        digest = hashlib.sha256()
        for name in self._sources:
            spec = find_spec(name)
            if spec is None or spec.origin is None:
                raise ModuleNotFoundError(name)
            file = Path(spec.origin)
            modules = file.parent.glob("*.py") if file.name == "__init__.py" else [file]
            for each in sorted(modules):
                digest.update(each.name.encode() + b"\0" + each.read_bytes())
        return digest.hexdigest()[:16]

    def directory(self) -> Path | None:
        """Return a directory to keep compiled code in, which exists and can be written to.

        Below ``NUMBA_CACHE_DIR`` where the user has set it, else ``transientcam/kernels`` in the
        user's cache directory (XDG). None where nothing can be written to, as with a read-only home
        directory; a name in a directory that others can write to is never used, for they could put
        code there.
        """
        chosen = self._environ.get("NUMBA_CACHE_DIR")
        if chosen:
            bases = [Path(chosen)]
        else:
            bases = [Path(base) for base in (self._environ.get("XDG_CACHE_HOME"),) if base]
            home = self._environ.get("HOME") or self._environ.get("USERPROFILE")
            bases += [Path(home) / ".cache"] if home else []
            bases = [base / "transientcam" / "kernels" for base in bases if base.is_absolute()]
        directories = (base / self.digest for base in bases)
        return next((each for each in directories if _is_writable(each)), None)

    def compile(self, dispatcher: Any, signature: tuple[Any, ...]) -> Callable[..., Any]:
        """Compile a function of numba's ``jit`` for one signature, or load it from the cache.

        Returns
        -------
        entry
            Unpacks its arguments by that signature without looking at their types, so that no call,
            whatever it is handed, can start the compiler on its thread.
        """
        directory = self.directory()
        if directory is not None and not dispatcher.signatures:
            from numba.core import config as numba_config

            config: Any = numba_config  # only partly annotated
            # the place is chosen by a global setting at the moment of enabling: other users of
            # numba in this process keep theirs
            with _ENABLING:
                previous = config.CACHE_DIR
                config.CACHE_DIR = str(directory)
                try:
                    dispatcher.enable_caching()
                finally:
                    config.CACHE_DIR = previous
        compiled: Callable[..., Any] = dispatcher.compile(signature)
        return compiled


@contextmanager
def only_from_cache() -> Iterator[None]:
    """Compile nothing on this thread inside: raises `NotKept` instead.

    numba reports what it is about to compile, where the cache has nothing.
    """
    from numba.core import event

    thread = threading.get_ident()

    class Refusal(event.Listener):
        def on_start(self, event: Any) -> None:
            if threading.get_ident() == thread:
                raise NotKept

        def on_end(self, event: Any) -> None:
            pass

    with event.install_listener("numba:compile", Refusal()):
        yield


def _is_writable(directory: Path) -> bool:
    try:
        directory.mkdir(parents=True, exist_ok=True, mode=0o700)
        tempfile.TemporaryFile(dir=directory).close()
    except OSError:
        return False
    return True
