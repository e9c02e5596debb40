"""What the simulated camera costs, and how true it is: ``docs/simulation.md``."""
