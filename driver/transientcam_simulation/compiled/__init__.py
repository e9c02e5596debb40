"""Compiling of what the simulated light computes pixel by pixel.

numba is imported when a name of `_compiling` is asked for: scenes that stand still need none.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
