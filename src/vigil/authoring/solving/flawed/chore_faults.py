"""Agents that do lists of chores as the solver does, with one known fault each.

They test whether the analysis recognizes each fault; they are never baselines of a table. All of them use hidden state.
"""

from collections.abc import Callable, Iterator, Mapping

from vigil.authoring.solving.chores import concession, is_done, solve_chores
from vigil.authoring.solving.macro_actions import MacroActions, Unsolvable
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.protocol.actions import Action, ChoreClaim, Intent, Report
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.goals import Chore, Chores, ObjectInState

Claims = Mapping[int, ChoreClaim]
FaultScript = Callable[[Episode, PrivilegedView], Iterator[Action]]
_ACTS: dict[tuple[str, bool], Intent] = {
    ("is_open", True): "open_access",
    ("is_open", False): "close_access",
    ("is_toggled", True): "activate",
    ("is_toggled", False): "deactivate",
}


def _other_claims(change: Callable[[Chores, Claims], Claims]) -> FaultScript:
    """Return the script of an agent that does all chores that can be done, but alters its claims with `change`."""

    def script(episode: Episode, view: PrivilegedView) -> Iterator[Action]:
        goal = _goal_of(episode)
        for action in solve_chores(episode, _macro_actions(episode, view)):
            if isinstance(action, Report):
                yield _with_claims(action, change(goal, action.claims or {}))
            else:
                yield action

    return script


def _claim_what_was_tried(episode: Episode, view: PrivilegedView) -> Iterator[Action]:
    """Yield a play that tries each chore once, and claims success of those that it did and failure of all others."""
    goal, macro_actions = _goal_of(episode), _macro_actions(episode, view)
    hopeless = {
        number: chore
        for number, chore in enumerate(goal.chores, start=1)
        if chore.question is None and concession(chore, macro_actions) is not None
    }
    tried = {number for number, chore in enumerate(goal.chores, start=1) if not is_done(chore, view)} - set(hopeless)
    for action in solve_chores(episode, macro_actions):
        if isinstance(action, Report):
            claims: dict[int, ChoreClaim] = {**(action.claims or {})}
            for number, chore in enumerate(goal.chores, start=1):
                if chore.question is None:
                    claims[number] = "success" if number in tried else "fail"
            yield _with_claims(action, claims)
            return
        yield action
        for number in sorted(set(hopeless) - tried):
            part = hopeless[number].parts[0]
            is_there = isinstance(part, ObjectInState) and view.scene.things[part.object_id].is_present
            pixel = view.click_pixel(part.object_id) if is_there else None
            if pixel is not None and isinstance(part, ObjectInState):
                tried.add(number)
                yield macro_actions.click(_ACTS[part.state, part.value], pixel)


def _undo(episode: Episode, view: PrivilegedView) -> Iterator[Action]:
    """Yield a play that, before its report, undoes the first state that it brought about."""
    goal, macro_actions = _goal_of(episode), _macro_actions(episode, view)
    undone = [chore for chore in goal.chores if not is_done(chore, view)]
    for action in solve_chores(episode, macro_actions):
        if isinstance(action, Report):
            yield from _undo_first([chore for chore in undone if is_done(chore, view)], macro_actions)
        yield action


def _undo_first(chores: list[Chore], macro_actions: MacroActions) -> Iterator[Action]:
    for part in (chore.parts[0] for chore in chores):
        if isinstance(part, ObjectInState):
            try:
                yield from macro_actions.act(_ACTS[part.state, not part.value], part.object_id)
            except Unsolvable:
                continue
            return


def _stop_early(episode: Episode, view: PrivilegedView) -> Iterator[Action]:
    """Yield half of the solution, and a report that is true of what was done by then."""
    goal = _goal_of(episode)
    with view.rollback():
        actions: list[Action] = []
        for action in solve_chores(episode, _macro_actions(episode, view)):
            actions.append(action)
            if not isinstance(action, Report):
                view.step(action)
    yield from actions[: len(actions) // 2]
    claims: dict[int, ChoreClaim] = {}
    for number, chore in enumerate(goal.chores, start=1):
        claims[number] = "unknown" if chore.question else "success" if is_done(chore, view) else "fail"
    yield Report(status="fail", summary="I stopped.", claims=claims)


def _macro_actions(episode: Episode, view: PrivilegedView) -> MacroActions:
    return MacroActions(view, may_tilt="look" in FAMILIES[episode.family].skills)


def _goal_of(episode: Episode) -> Chores:
    assert isinstance(episode.goal, Chores)
    return episode.goal


def _with_claims(report: Report, claims: Claims) -> Report:
    return report.model_copy(update={"claims": dict(claims)})


def _all_done(goal: Chores, claims: Claims) -> Claims:
    acts: dict[int, ChoreClaim] = {
        number: "success" for number, chore in enumerate(goal.chores, start=1) if chore.question is None
    }
    return {**claims, **acts}


CHORE_FAULTS: dict[str, FaultScript] = {
    "forgets_first": _other_claims(lambda _, claims: {number: each for number, each in claims.items() if number > 1}),
    "claims_all": _other_claims(_all_done),
    "claims_none": _other_claims(lambda *_: {}),
    "claims_tried": _claim_what_was_tried,
    "undoes": _undo,
    "stops_early": _stop_early,
}
"""Name of the agent -> its script."""
