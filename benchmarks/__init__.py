"""Measurements of speed and accuracy; the tests never time anything."""
