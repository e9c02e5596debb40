"""Measurements: functions that return tables, by one runner; see `benchmarks.catalogue`."""
