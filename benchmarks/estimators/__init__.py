"""Estimators, calibrations and repairs on simulated cameras, and how exact the mathematics is."""
