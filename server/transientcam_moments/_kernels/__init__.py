"""The kernels that `transientcam_moments._dispatch` looks up, as functions for numba.

Only the thread or the process that compiles imports `compiler` and what it consists of, which
imports numba.
"""
