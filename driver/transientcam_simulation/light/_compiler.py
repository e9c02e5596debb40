"""The compiled light of scenes that move, loaded when one is first seen.

The driver does not depend on numba, and scenes that stand still do not need it.
"""

import logging
import sys
import threading
from importlib import import_module
from typing import Final

from transientcam_driver.errors import CompilerMissing

_MOVING: Final = "transientcam_simulation.light._moving"
_LOADING: Final = threading.Lock()
_log = logging.getLogger("transientcam_driver")


def load_compiled() -> None:
    """Compile what computes the light of surfaces that move, or load it from the cache; once.

    Raises CompilerMissing: numba is not installed, or does not work here.
    """
    with _LOADING:
        if _MOVING in sys.modules:
            return
        _log.info(
            "loading the compiled light of scenes that move; on a new machine it is compiled "
            "first, which takes up to a minute"
        )
        try:
            import_module(_MOVING)
        except ImportError as error:
            raise CompilerMissing(str(error)) from error
