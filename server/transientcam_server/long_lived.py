"""What stays for the life of the process, kept out of the way of Python's garbage collector.

Compiled kernels and libraries are some hundred thousand objects. A full collection walks through
all of them and stops every thread for it, for longer than several frames take; and it finds next
to nothing, because what frames and clients leave is freed as soon as nobody refers to it.
"""

import gc
import threading
from typing import Final

NAME: Final = "long-lived"


def set_aside() -> None:
    """Collect once more, and from then on pass over everything that is there now."""
    gc.collect()
    gc.freeze()


def set_aside_after(compiling: threading.Thread) -> threading.Thread:
    """Set aside what is there now, and once more what the compiler leaves when it has ended."""
    set_aside()

    def wait() -> None:
        compiling.join()
        set_aside()

    waiting = threading.Thread(target=wait, name=NAME, daemon=True)
    waiting.start()
    return waiting
