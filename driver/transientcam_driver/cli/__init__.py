"""What the driver adds to the ``transientcam`` command; each module is an entry point."""
