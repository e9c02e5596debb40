"""Which sequence to take: for a target accuracy, or for a budget of time."""

from transientcam_server.planning.candidates import candidates
from transientcam_server.planning.choice import Choice, choices_on_front
from transientcam_server.planning.goal import Goal
from transientcam_server.planning.plan import Plan, plan

__all__ = ["Choice", "Goal", "Plan", "candidates", "choices_on_front", "plan"]
