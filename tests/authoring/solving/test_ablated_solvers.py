"""Agents of limited skill: what each lacks costs it what it should, and nothing else."""

import pytest

from vigil.agents.registry import is_known
from vigil.authoring.packing.baselines import AGENTS
from vigil.authoring.solving.flawed.ablated_solvers import ABLATIONS
from vigil.authoring.solving.solvers import privileged_agent
from vigil.env import Env
from vigil.packs.pack import Pack
from vigil.protocol.episode import Episode
from vigil.protocol.profile import Profile
from vigil.records.record import EpisodeRecord
from vigil.scoring.outcomes import score
from vigil.sim.privileged import PrivilegedSimulator


def play(name: str, episode: Episode, starter: Pack, simulator: PrivilegedSimulator) -> EpisodeRecord:
    env = Env(simulator, starter.house_of, Profile())
    observation = env.reset(episode)
    agent = privileged_agent(name, episode, simulator)
    agent.start(episode.instruction)
    while observation is not None:
        assert not observation.is_drawn
        observation = env.step(agent.act(observation))
    return env.record()


def first_of(starter: Pack, family: str) -> Episode:
    return next(episode for episode in starter.episodes if episode.family == family)


@pytest.mark.parametrize("name", ABLATIONS)
def test_the_same_episode_is_played_the_same(name: str, starter: Pack, simulator: PrivilegedSimulator) -> None:
    episode = first_of(starter, "VS")
    first, again = (play(name, episode, starter, simulator) for _ in range(2))
    assert [step.action for step in first.steps] == [step.action for step in again.steps]


@pytest.mark.parametrize("family", ["PG", "DA", "SV", "AI", "CR"])
def test_what_is_in_view_needs_no_search(family: str, starter: Pack, simulator: PrivilegedSimulator) -> None:
    """The one that only has to search does as the solver where the target is seen at the start."""
    episode = first_of(starter, family)
    found, solved = (play(name, episode, starter, simulator) for name in ("searching", "solver"))
    assert score(episode, found).B
    assert [step.action.skill_name for step in found.steps if step.action] == [
        step.action.skill_name for step in solved.steps if step.action
    ]


def test_searching_takes_longer_than_knowing_where(starter: Pack, simulator: PrivilegedSimulator) -> None:
    searches = [episode for episode in starter.episodes if episode.family == "SI"][:4]
    steps = {
        name: sum(len(play(name, episode, starter, simulator).steps) for episode in searches)
        for name in ("searching", "solver")
    }
    assert steps["searching"] > steps["solver"]


def test_they_are_never_baselines_nor_agents_without_sight() -> None:
    assert not set(ABLATIONS) & set(AGENTS)
    assert not any(is_known(name) for name in ABLATIONS)
    assert all(ablation.description for ablation in ABLATIONS.values())
