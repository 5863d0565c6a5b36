"""The table of all actions that the engine has, by name."""

from vigil.thor.actions import finding, handling, moving, placing, scenes
from vigil.thor.actions.action import Action

ACTIONS: dict[str, Action] = {
    action.name: action for module in (scenes, moving, handling, placing, finding) for action in module.ACTIONS
}
