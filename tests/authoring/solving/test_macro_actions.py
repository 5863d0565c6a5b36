"""Macro actions, one at a time."""

import pytest

from vigil.authoring.solving.goal_actions import is_doable
from vigil.authoring.solving.macro_actions import MacroActions, Unsolvable
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.packs.pack import Pack
from vigil.protocol.world import ObjectSetup, Setup
from vigil.sim.privileged import PrivilegedSimulator


def stage_of(starter: Pack, simulator: PrivilegedSimulator, family: str, template: str) -> tuple[PrivilegedView, str]:
    episode = next(e for e in starter.episodes if (e.family, e.provenance.template) == (family, template))
    simulator.load(starter.house_of(episode))
    simulator.reset(episode.start, episode.setup)
    return PrivilegedView(simulator), episode.goal.object_id


def test_act_picks_what_was_asked_for(starter: Pack, simulator: PrivilegedSimulator) -> None:
    view, target = stage_of(starter, simulator, "AI", "pick")
    for action in MacroActions(view, may_tilt=False).act("pick", target):
        assert view.step(action).refusal is None  # type: ignore[arg-type]
    assert view.held == target


def test_what_is_refused_anywhere_is_given_up_at_once(starter: Pack, simulator: PrivilegedSimulator) -> None:
    view, target = stage_of(starter, simulator, "CR", "hand")
    with pytest.raises(Unsolvable, match="hand_full"):
        MacroActions(view, may_tilt=False).find_click("pick", target)


def test_what_is_to_be_put_on_something_is_not_put_into_what_opens(
    starter: Pack, simulator: PrivilegedSimulator
) -> None:
    view, _ = stage_of(starter, simulator, "SM", "reveal_pick")
    macro_actions = MacroActions(view, may_tilt=False)
    things = view.scene.things.values()
    drawer = next(thing for thing in things if thing.is_drawer)
    with pytest.raises(Unsolvable, match="no level surface to put things on"):
        macro_actions.placement_targets(drawer.id, inside=False)
    assert macro_actions.placement_targets(drawer.id, inside=True).surfaces


def test_put_down_empties_the_hand_out_of_the_way(starter: Pack, simulator: PrivilegedSimulator) -> None:
    view, target = stage_of(starter, simulator, "CR", "hand")
    macro_actions = MacroActions(view, may_tilt=False)
    for action in macro_actions.put_down(lambda: True):
        view.step(action)  # type: ignore[arg-type]
    assert view.held is None
    macro_actions.find_click("pick", target)


def test_behind_an_obstacle_the_goal_cannot_be_done(starter: Pack, simulator: PrivilegedSimulator) -> None:
    episode = next(episode for episode in starter.episodes if episode.provenance.template == "obstacle")
    view, _ = stage_of(starter, simulator, "CR", "obstacle")
    assert not is_doable(episode.goal, MacroActions(view, may_tilt=True, is_exhaustive=True))
    absent = {episode.bindings["obstacle"]: ObjectSetup(is_absent=True)}
    simulator.reset(episode.start, Setup(objects={**episode.setup.objects, **absent}))
    assert is_doable(episode.goal, MacroActions(view, may_tilt=False))
