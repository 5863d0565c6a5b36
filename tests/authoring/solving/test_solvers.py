"""Solvers and the privileged agents made of them, on episodes of the starter pack."""

import pytest

from tests.support.published_runs import PUBLISHED
from vigil.authoring.solving.flawed.ablated_solvers import ABLATIONS
from vigil.authoring.solving.flawed.chore_faults import CHORE_FAULTS
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.authoring.solving.solvers import PRIVILEGED, privileged_agent
from vigil.env import Env
from vigil.errors import SettingError
from vigil.packs.pack import Pack
from vigil.protocol.actions import Navigate, Report
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.profile import Profile
from vigil.records.record import EpisodeRecord
from vigil.scoring.outcomes import Outcome, score
from vigil.sim.privileged import PrivilegedSimulator


def first_of(starter: Pack, family: str) -> Episode:
    return next(episode for episode in starter.episodes if episode.family == family)


def play(name: str, episode: Episode, starter: Pack, simulator: PrivilegedSimulator) -> tuple[EpisodeRecord, Outcome]:
    env = Env(simulator, starter.house_of, Profile())
    observation = env.reset(episode)
    agent = privileged_agent(name, episode, simulator)
    agent.start(episode.instruction)
    while observation is not None:
        assert not observation.is_drawn
        observation = env.step(agent.act(observation))
    record = env.record()
    return record, score(episode, record)


@pytest.mark.parametrize("family", PUBLISHED)
def test_solver_completes_and_reports(family: str, starter: Pack, simulator: PrivilegedSimulator) -> None:
    episode = first_of(starter, family)
    record, outcome = play("solver", episode, starter, simulator)
    assert (outcome.W, outcome.W_strict, outcome.B) == (True, True, True)
    used = {step.action.skill_name for step in record.steps if step.action is not None}
    assert used <= {skill.removesuffix("(ground)") for skill in FAMILIES[episode.family].skills}
    assert len(record.steps) <= episode.max_steps


@pytest.mark.parametrize("family", PUBLISHED)
def test_a_body_that_errs_completes_and_reports(family: str, starter: Pack, simulator: PrivilegedSimulator) -> None:
    record, outcome = play("noisy_solver", first_of(starter, family), starter, simulator)
    assert (outcome.W, outcome.B) == (True, True)
    walks = [a.magnitude for a in (step.action for step in record.steps) if isinstance(a, Navigate)]
    assert all(magnitude == int(magnitude) for magnitude in walks)


@pytest.mark.parametrize("family", PUBLISHED)
def test_never_report_keeps_what_it_reached(family: str, starter: Pack, simulator: PrivilegedSimulator) -> None:
    _, outcome = play("never_report", first_of(starter, family), starter, simulator)
    assert (outcome.W, outcome.B, outcome.label) == (True, False, "NR")


@pytest.mark.parametrize("family", ["PG", "AI", "SM", "CR"])
def test_premature_claims_success_half_way(family: str, starter: Pack, simulator: PrivilegedSimulator) -> None:
    record, outcome = play("premature", first_of(starter, family), starter, simulator)
    assert (outcome.W, outcome.label, outcome.subtype) == (False, "FR", "false_success")
    assert len(record.steps) < len(starter.solutions[record.episode_id].actions)


def test_an_unknown_name_is_refused(starter: Pack, simulator: PrivilegedSimulator) -> None:
    with pytest.raises(SettingError, match="solver"):
        privileged_agent("genius", starter.episodes[0], simulator)
    assert set(PRIVILEGED) == {
        "solver",
        "noisy_solver",
        "never_report",
        "premature",
        "acts_anyway",
        *ABLATIONS,
        *CHORE_FAULTS,
    }


def test_a_rehearsal_leaves_no_trace(starter: Pack, simulator: PrivilegedSimulator) -> None:
    episode = first_of(starter, "SM")
    simulator.load(starter.house_of(episode))
    simulator.reset(episode.start, episode.setup)
    ids = simulator.object_ids()
    before = simulator.world(ids)
    view = PrivilegedView(simulator)
    with view.rollback():
        for action in starter.solutions[episode.id].actions[:-1]:
            assert not isinstance(action, Report)
            view.step(action)
        assert simulator.world(ids) != before
    assert simulator.world(ids) == before
