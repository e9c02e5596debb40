"""The verbs of the simulation: scenes, explain, emulate."""
