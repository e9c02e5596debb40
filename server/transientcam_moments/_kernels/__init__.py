"""The lanes of `transientcam_moments._lanes`, and how they are compiled.

Only the thread or the process that compiles imports `compiler` and what it consists of, which
imports numba.
"""
