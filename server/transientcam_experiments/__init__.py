"""What the software is used to measure: the paper's figures, and the price of accuracy.

The verbs ``transientcam paper`` and ``transientcam tradeoff`` are in `commands`; each imports its
package when it runs.
"""
