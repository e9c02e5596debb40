"""What the simulated camera costs, and how true it is: ``docs/measured/simulation.md``."""
