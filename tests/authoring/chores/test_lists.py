"""Packaged lists of chores: what the pack promises, that lists are verified, and that faults in them are found."""

from collections import Counter
from collections.abc import Callable

import pytest

from vigil.authoring.chores import rules
from vigil.authoring.chores.budgets import FACTORS, STEPS_PER_ROOM, is_within_budget
from vigil.authoring.chores.certify import ListCertifier
from vigil.authoring.chores.claim_controls import verdict_with_claims, wrong_claims
from vigil.authoring.chores.compose import LONG_FROM
from vigil.authoring.review.validate import Validator
from vigil.base.numbered_list import read_list, write_list
from vigil.packs.pack import CHORES_BUDGETS, Pack
from vigil.protocol.actions import ChoreClaim, Report
from vigil.protocol.episode import Episode
from vigil.protocol.goals import Chores
from vigil.protocol.profile import ITEMISED_REPORT
from vigil.records.record import EpisodeRecord
from vigil.scoring.chore_answers import CHORE_KINDS, ListAnswer, check_answer, list_answers
from vigil.scoring.chores import score_list
from vigil.scoring.closure import evidence_seen
from vigil.sim.privileged import PrivilegedSimulator

PACK = "vigil_chores_200_v5"
OPPOSITE: dict[ChoreClaim, ChoreClaim] = {"on": "off", "off": "on", "open": "closed", "closed": "open"}


@pytest.fixture(scope="module")
def pack() -> Pack:
    return Pack.load(PACK)


@pytest.fixture(scope="module")
def answers(pack: Pack) -> dict[str, ListAnswer]:
    return list_answers(pack.folder)


@pytest.fixture
def certifier(simulator: PrivilegedSimulator) -> ListCertifier:
    return ListCertifier(simulator)


@pytest.fixture(scope="module")
def shortest(pack: Pack, answers: dict[str, ListAnswer]) -> Episode:
    """The list that the solver closes in the fewest steps, of those with an order to keep and a chore not to be met."""

    def has_all(answer: ListAnswer) -> bool:
        return {"order", "impossible"} <= {chore.kind for chore in answer.chores}

    fitting = [each for each in pack.episodes if has_all(answers[each.id])]
    return min(fitting, key=lambda each: (answers[each.id].solver_steps or 0, each.id))


def test_lengths_and_kinds_are_even(pack: Pack, answers: dict[str, ListAnswer]) -> None:
    assert Counter(len(answer.chores) for answer in answers.values()) == dict.fromkeys(range(3, 11), 25)
    kinds = Counter(chore.kind for answer in answers.values() for chore in answer.chores)
    assert sum(kinds.values()) == pack.manifest.meta["claims"] >= 1000
    assert dict(kinds) == pack.manifest.meta["chores"]
    assert all(0.08 <= kinds[kind] / sum(kinds.values()) <= 0.126 for kind in CHORE_KINDS)
    assert {answer.rooms for answer in answers.values()} == set(range(3, 11))
    reasons = Counter(chore.reason for answer in answers.values() for chore in answer.chores)
    assert {"absent", "broken", "locked", "no_fit"} <= reasons.keys()


def test_budgets_are_a_multiple_of_the_solvers_steps(pack: Pack, answers: dict[str, ListAnswer]) -> None:
    least, most = CHORES_BUDGETS
    for episode in pack.episodes:
        steps = len(pack.solutions[episode.id].actions)
        assert answers[episode.id].solver_steps == steps
        rooms = answers[episode.id].rooms
        assert is_within_budget(steps, rooms, episode.max_steps)
        assert least <= episode.max_steps <= most
        if least < episode.max_steps < most:
            assert FACTORS[0] <= (episode.max_steps - STEPS_PER_ROOM * rooms) / steps <= FACTORS[1] + 5 / steps


def test_the_recorded_claims_are_those_that_the_answers_accept(pack: Pack, answers: dict[str, ListAnswer]) -> None:
    for episode in pack.episodes:
        answer, last = answers[episode.id], pack.solutions[episode.id].actions[-1]
        check_answer(episode, answer)
        assert isinstance(last, Report)
        assert last.claims == {number: chore.accepted[0] for number, chore in enumerate(answer.chores, start=1)}
        assert last.status == ("success" if all(chore.is_possible for chore in answer.chores) else "fail")


def test_ids_and_words_do_not_tell_what_cannot_be_met(pack: Pack, answers: dict[str, ListAnswer]) -> None:
    for episode in pack.episodes:
        assert episode.id.split("_")[1] == "chores"
        words = episode.instruction.lower()
        assert not any(word in words for word in ("impossible", "broken", "absent", "locked", "already"))


def test_a_list_is_verified(
    shortest: Episode, pack: Pack, answers: dict[str, ListAnswer], certifier: ListCertifier
) -> None:
    actions = pack.solutions[shortest.id].actions
    assert certifier.verify(shortest, answers[shortest.id], pack.house_of(shortest), actions) == []


def test_long_lists_have_a_state_to_remember_or_a_hidden_object(pack: Pack, answers: dict[str, ListAnswer]) -> None:
    """The state is that of a thing about which another chore is."""
    long = [episode for episode in pack.episodes if len(answers[episode.id].chores) >= LONG_FROM]
    with_state = [episode for episode in long if remembered_by(episode)]
    with_hidden = [episode for episode in long if any(each.kind == "hidden" for each in answers[episode.id].chores)]
    assert len(with_state) >= 0.85 * len(long)
    assert len(with_hidden) >= 0.85 * len(long)
    assert len({episode.id for episode in (*with_state, *with_hidden)}) >= 0.9 * len(long)
    for episode in with_state:
        forms = {answers[episode.id].chores[place].form.partition("_")[0] for place in remembered_by(episode)}
        assert forms == {"remember"}


def remembered_by(episode: Episode) -> list[int]:
    """Return the indices of the chores whose condition is about a thing of another chore."""
    assert isinstance(episode.goal, Chores)
    chores = episode.goal.chores
    return [
        place
        for place, chore in enumerate(chores)
        if chore.condition is not None
        and any(chore.condition.object_id in other.ids() for other in chores if other != chore)
    ]


def test_the_solver_sees_a_state_to_remember_before_it_changes_it(
    pack: Pack, answers: dict[str, ListAnswer], simulator: PrivilegedSimulator
) -> None:
    validator = Validator(simulator, profile=ITEMISED_REPORT)

    def played(episode: Episode) -> tuple[EpisodeRecord, int, list[int]]:
        """Return the solver's play, the index of a chore with a state to remember, and the steps that change it."""
        record = validator.play(episode, pack.house_of(episode), pack.solutions[episode.id].actions)
        place = remembered_by(episode)[0]
        assert isinstance(episode.goal, Chores)
        condition = episode.goal.chores[place].condition
        assert condition is not None
        effects = [(step.index, step.effect) for step in record.steps if step.effect]
        return record, place, [index for index, effect in effects if condition.object_id in effect.changed]

    short = sorted(filter(remembered_by, pack.episodes), key=lambda each: len(pack.solutions[each.id].actions))
    record, place, changing = next(found for episode in short if (found := played(episode))[2])
    before = record.model_copy(
        update={"steps": record.steps[: changing[0]], "worlds": record.worlds[: changing[0] + 1]}
    )
    assert evidence_seen(answers[record.episode_id].chores[place].evidence, before) == 1.0


def _with_line(episode: Episode, change: Callable[[list[str]], list[str]]) -> Episode:
    opening, lines = episode.instruction.split("\n")[0], list(read_list(episode.instruction))
    return episode.model_copy(update={"instruction": write_list(opening, change(lines))})


def test_words_that_mean_something_else_are_found(
    shortest: Episode, pack: Pack, answers: dict[str, ListAnswer], certifier: ListCertifier
) -> None:
    moved = _with_line(shortest, lambda lines: [*lines[1:], lines[0]])
    actions = pack.solutions[shortest.id].actions
    found = certifier.verify(moved, answers[shortest.id], pack.house_of(shortest), actions)
    assert [finding.rule for finding in found] == ["distinguished"]


def test_a_kind_that_does_not_fit_is_found(
    shortest: Episode, pack: Pack, answers: dict[str, ListAnswer], certifier: ListCertifier
) -> None:
    answer = answers[shortest.id]
    place = next(place for place, chore in enumerate(answer.chores) if chore.kind == "order")
    changed = answer.chores[place].model_copy(update={"kind": "plain", "with_chores": ()})
    chores = (*answer.chores[:place], changed, *answer.chores[place + 1 :])
    actions = pack.solutions[shortest.id].actions
    wrong = answer.model_copy(update={"chores": chores})
    found = certifier.verify(shortest, wrong, pack.house_of(shortest), actions)
    assert "entangled_as_answered" in {finding.rule for finding in found}


@pytest.fixture(scope="module")
def searched(pack: Pack, answers: dict[str, ListAnswer]) -> Episode:
    """The list with a hidden object that the solver closes in the fewest steps."""
    fitting = [each for each in pack.episodes if any(one.kind == "hidden" for one in answers[each.id].chores)]
    return min(fitting, key=lambda each: (answers[each.id].solver_steps or 0, each.id))


@pytest.mark.parametrize(
    ("limit", "value", "rule"), [("MIN_PICKED_PX", 10**6, "seen_where_picked"), ("MAX_SEARCHED", 0, "not_shut_away")]
)
def test_a_hidden_object_that_cannot_be_found_or_recognized_is_found(
    limit: str, value: int, rule: str,
    searched: Episode, pack: Pack, answers: dict[str, ListAnswer], certifier: ListCertifier,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    task = searched, answers[searched.id], pack.house_of(searched), pack.solutions[searched.id].actions
    assert certifier.verify(*task) == []
    monkeypatch.setattr(rules, limit, value)
    assert {finding.rule for finding in certifier.verify(*task)} == {rule}


def test_a_text_order_that_works_is_found(
    shortest: Episode, pack: Pack, answers: dict[str, ListAnswer], certifier: ListCertifier
) -> None:
    """The list in the order in which the solver does its chores."""
    goal, answer = shortest.goal, answers[shortest.id]
    assert isinstance(goal, Chores)
    ordered = [place for place, chore in enumerate(answer.chores) if chore.kind == "order"]
    swap = dict(zip(ordered, ordered[::-1], strict=True)) if len(ordered) == 2 else {}
    assert swap
    places = [swap.get(place, place) for place in range(len(goal.chores))]
    chores = tuple(goal.chores[place] for place in places)
    listed = Chores(object_id=chores[0].parts[0].object_id, chores=chores)
    moved = _with_line(shortest, lambda lines: [lines[place] for place in places])
    moved = moved.model_copy(update={"goal": listed})
    again = answer.model_copy(update={"chores": tuple(answer.chores[place] for place in places)})
    found = certifier.verify(moved, again, pack.house_of(shortest), pack.solutions[shortest.id].actions)
    assert "text_order_does_not_help" in {finding.rule for finding in found}


def test_no_wrong_claims_close_a_list(
    shortest: Episode, pack: Pack, answers: dict[str, ListAnswer], simulator: PrivilegedSimulator
) -> None:
    validator = Validator(simulator, profile=ITEMISED_REPORT)
    record = validator.play(shortest, pack.house_of(shortest), pack.solutions[shortest.id].actions)
    outcome = score_list(answers[shortest.id], shortest, record, has_claims=True)
    assert outcome.B
    assert outcome.T == 1.0
    true: dict[int, ChoreClaim] = {chore.number: chore.claim for chore in outcome.chores if chore.claim is not None}
    assert verdict_with_claims(outcome, true).B
    names = {name: verdict_with_claims(outcome, claims).B for name, claims in wrong_claims(true)}
    assert len(names) >= 3 * len(true) + 3
    assert not any(names.values())


def test_a_wrong_claim_in_a_solution_is_found(
    shortest: Episode, pack: Pack, answers: dict[str, ListAnswer], certifier: ListCertifier
) -> None:
    *actions, last = pack.solutions[shortest.id].actions
    assert isinstance(last, Report)
    claims = last.claims or {}
    first = claims[1]
    wrong = {**claims, 1: OPPOSITE.get(first, "fail" if first == "success" else "success")}
    said = last.model_copy(update={"claims": wrong})
    found = certifier.verify(shortest, answers[shortest.id], pack.house_of(shortest), [*actions, said])
    assert found[0].rule == "closes_correctly"
    assert found[0].message.startswith("chore 1:")
