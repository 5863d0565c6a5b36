"""Authoring works on any backend that keeps the privileged protocol."""

from itertools import islice

import numpy as np
import pytest

from tests.support.protocol_backend import with_protocol_only
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.families.si.drafts import seeking
from vigil.authoring.review.validate import Validator
from vigil.authoring.solving.flawed.ablated_solvers import ABLATIONS
from vigil.authoring.solving.flawed.chore_faults import CHORE_FAULTS
from vigil.authoring.solving.solvers import PRIVILEGED, privileged_agent
from vigil.env import Env
from vigil.packs.pack import Pack
from vigil.protocol.profile import Profile
from vigil.scoring.outcomes import score
from vigil.sim.privileged import PrivilegedSimulator


@pytest.fixture
def backend(simulator: PrivilegedSimulator) -> PrivilegedSimulator:
    return with_protocol_only(simulator)


def test_episodes_are_proposed_and_validated(starter: Pack, backend: PrivilegedSimulator) -> None:
    house = starter.house_of(starter.episodes[0])
    drafts = list(islice(seeking(HouseContext(backend, house, np.random.default_rng(5)), "pick"), 3))
    assert drafts
    validator = Validator(backend)
    assert any(validator.validate(draft, house).is_valid for draft in drafts)


@pytest.mark.parametrize("agent", [name for name in PRIVILEGED if name not in CHORE_FAULTS])
def test_privileged_agents_play(agent: str, starter: Pack, backend: PrivilegedSimulator) -> None:
    episode = next(episode for episode in starter.episodes if episode.family == "SM")
    env = Env(backend, starter.house_of, Profile())
    observation = env.reset(episode)
    player = privileged_agent(agent, episode, backend)
    player.start(episode.instruction)
    while observation is not None:
        observation = env.step(player.act(observation))
    is_solved = score(episode, env.record()).B
    assert is_solved is (agent in ("solver", "noisy_solver", "acts_anyway")) or agent in ABLATIONS
