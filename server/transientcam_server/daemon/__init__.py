"""The process around the service: settings, socket, connections, signals, systemd, mDNS.

`configuration` reads the settings, `server` listens and serves, `check` and `doctor` say what is
wrong.
"""
