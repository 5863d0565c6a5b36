"""Actions that resolve a constraint."""

from vigil.authoring.solving.goal_actions import Steps, is_doable
from vigil.authoring.solving.macro_actions import MacroActions
from vigil.protocol.actions import Intent
from vigil.protocol.goals import Constraint, Goal, ObjectHeld


def resolve_constraint(constraint: Constraint, goal: Goal, macro_actions: MacroActions) -> Steps:
    """Yield the actions that resolve a constraint. If the goal needs the hand, the object in the hand is also put down.

    Raises Unsolvable if there is no way.
    """
    intents: dict[str, Intent] = {
        "object_open": "open_access",
        "object_closed": "close_access",
        "object_on": "activate",
        "object_off": "deactivate",
        "object_moved": "pick",
    }
    if constraint.kind in intents:
        yield from macro_actions.act(intents[constraint.kind], constraint.object_id)
    if constraint.kind == "object_released" or (constraint.kind == "object_moved" and isinstance(goal, ObjectHeld)):
        yield from macro_actions.put_down(lambda: is_doable(goal, macro_actions))
