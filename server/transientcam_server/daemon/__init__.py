"""The process around the service: settings, socket, connections, signals, systemd, mDNS."""
