"""The table of all actions that the engine has, by name."""

from vigil.thor.actions import finding, hand, handling, houses, moving, placing, scenes, shuffling, states
from vigil.thor.actions.action import Action

MODULES = (houses, scenes, moving, handling, hand, placing, shuffling, states, finding)
"""The modules that define actions."""
ACTIONS: dict[str, Action] = {action.name: action for module in MODULES for action in module.ACTIONS}
