"""What is measured of an episode: each figure where the starter pack and a house made for it tell the answer."""

from collections.abc import Sequence

import pytest

from vigil.authoring.packing.episode_measures import measures_of_episode
from vigil.packs.pack import Pack
from vigil.protocol.actions import Action, Navigate
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.scoring.levels import LevelMeasures
from vigil.sim.privileged import PrivilegedSimulator


@pytest.fixture(scope="module")
def figures(
    starter: Pack, simulator: PrivilegedSimulator
) -> dict[str, tuple[Episode, Sequence[Action], LevelMeasures]]:
    """The figures of the first episode of each family."""
    found = {}
    for episode in starter.episodes:
        if episode.family not in found:
            house, actions = starter.house_of(episode), starter.solutions[episode.id].actions
            simulator.load(house)
            found[episode.family] = episode, actions, measures_of_episode(simulator, episode, house, actions)
    return found


def test_walks_and_turns_are_those_of_the_solution(
    figures: dict[str, tuple[Episode, Sequence[Action], LevelMeasures]],
) -> None:
    for episode, actions, found in figures.values():
        walks = [action for action in actions if isinstance(action, Navigate)]
        steps = sum(walk.magnitude for walk in walks if walk.mode in ("forward", "backward"))
        assert found.path_m == pytest.approx(0.25 * steps, abs=0.02)
        assert found.turns == sum(walk.mode.startswith("turn") for walk in walks)
        assert found.slack == pytest.approx(1 - len(actions) / episode.max_steps, abs=1e-3)


def test_houses_and_references(
    starter: Pack, figures: dict[str, tuple[Episode, Sequence[Action], LevelMeasures]]
) -> None:
    for episode, _, found in figures.values():
        is_searched = not FAMILIES[episode.family].visible_at_start
        rooms = len(starter.house_of(episode).document.rooms)
        assert found.rooms == (rooms if is_searched else 1)
        assert found.doors == 0 or rooms > 1
        assert 1 <= found.reference_words <= len(episode.instruction.split())


def test_what_is_in_view_at_the_start_is_sighted_there(
    figures: dict[str, tuple[Episode, Sequence[Action], LevelMeasures]],
) -> None:
    for family in ("PG", "DA", "SV", "AI", "CR"):
        assert figures[family][2].target_px > 0
        assert figures[family][2].occlusion < 1


def test_measuring_again_gives_the_same(
    starter: Pack,
    simulator: PrivilegedSimulator,
    figures: dict[str, tuple[Episode, Sequence[Action], LevelMeasures]],
) -> None:
    episode, actions, found = figures["SM"]
    house = starter.house_of(episode)
    simulator.load(house)
    assert measures_of_episode(simulator, episode, house, actions) == found


def test_a_shut_drawer_around_the_target_is_a_container(starter: Pack, simulator: PrivilegedSimulator) -> None:
    """Where the first link of a chain opens what the target lies in, there is something to open."""
    episode = next(e for e in starter.episodes if e.provenance.template.startswith("reveal"))
    house, actions = starter.house_of(episode), starter.solutions[episode.id].actions
    simulator.load(house)
    assert measures_of_episode(simulator, episode, house, actions).containers == 1
