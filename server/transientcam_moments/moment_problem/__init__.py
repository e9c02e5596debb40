"""The algorithms of the paper, each stated once, over planes of pixels (see `_arithmetic`).

The modules beside this folder call them with arrays; `_kernels` compiles them as they stand here.
``order`` is a tuple of length m; real and imaginary parts are banks apart.
"""
