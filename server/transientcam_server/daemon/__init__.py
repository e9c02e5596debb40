"""The process around the service: settings, socket, connections, signals, systemd, mDNS.

`configuration` reads the settings, `server` listens and serves, `check` and `doctor` say what is
wrong.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
