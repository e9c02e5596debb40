"""Kernels beside functions in NumPy: compiled by numba, kept, made ready in the background.

This is the machinery; what is compiled is in the libraries that use it. A library has one `Cache`
and one `Kernels`, and a function that returns the kernel of a key, made by `Cache.compile`. Its
calls look into `Kernels.compiled`, and `want` what they do not find there. Importing this package
imports no compiler: numba is imported by the thread, or the `ChildProcess`, that compiles.

`Spread` says how a kernel does parts of an image on several threads, and `empty` gives it memory
for its results.
"""

from transientcam_compiled._cache import Cache, NotKept, only_from_cache
from transientcam_compiled._kernels import THREAD, Kernels
from transientcam_compiled._memory import empty
from transientcam_compiled._process import ChildProcess, ProcessEnded, Tell, python
from transientcam_compiled._spread import (
    BLOCK,
    Part,
    Spread,
    at_once,
    blocks,
    cores,
    on_threads,
    over,
    over_all_cores,
    use_all_cores,
    use_one_thread,
)
