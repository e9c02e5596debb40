"""The speed of the reconstruction, all on the same data."""
