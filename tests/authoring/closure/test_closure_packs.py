"""A pack of the closure-stress suite from one house: drafted, frozen, verified, played blindly, reported."""

import json
import shutil
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from hashlib import sha256
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from tests.support import builders
from vigil.authoring.closure.certify import MIN_LOOKING_SHARE, Certifier, task_of
from vigil.authoring.closure.everything import HOME
from vigil.authoring.closure.generation import CLOSURE_GRAMMAR
from vigil.authoring.closure.guessing import BLIND, guessing
from vigil.authoring.closure.kinds.already import EVERYTHING_FORMS
from vigil.authoring.closure.kinds.impossible.tasks import BLOCKERS, impossible
from vigil.authoring.closure.kinds.look_alike.tasks import look_alike
from vigil.authoring.closure.kinds.silent_refusal import FULL
from vigil.authoring.closure.kinds.silent_refusal.tasks import silent_refusal
from vigil.authoring.closure.tasks import ClosureTask
from vigil.authoring.closure.twins import BrokenRule, check_hidden
from vigil.authoring.drafting.drafts import ClosureDraft, DraftsFile, Rejection
from vigil.authoring.drafting.generation import DraftWorker, GenerationSettings, SolvedSide
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import shows_px
from vigil.authoring.drafting.sources import GeneratedHouse
from vigil.authoring.language.referring import ROOM_NAMES
from vigil.authoring.packing.assemble import assemble
from vigil.authoring.packing.requests import PackRequest
from vigil.authoring.packing.selection import Candidate, candidates, select
from vigil.authoring.packing.verify import VerificationSettings, candidate_checker, verify_pack
from vigil.authoring.review.reviews import Review, Verdict, episode_sha256
from vigil.authoring.review.rules import RULES
from vigil.authoring.review.validate import BUDGET_SHARE, SUITE_RULES, Finding, Validator
from vigil.authoring.solving.evidence import NOTICE_READABLE_M
from vigil.authoring.solving.goal_actions import is_doable
from vigil.authoring.solving.macro_actions import MacroActions
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.cli import app
from vigil.errors import EpisodeError, InputError
from vigil.packs.pack import ANSWERS, Pack
from vigil.protocol.actions import InteractPixel, Report, Status
from vigil.protocol.episode import Episode
from vigil.protocol.goals import AllOf
from vigil.protocol.house import House
from vigil.protocol.profile import Profile
from vigil.protocol.prompt import rendered_sha256
from vigil.protocol.world import Setup
from vigil.records.record import EpisodeRecord
from vigil.scoring.closure import (
    CLOSURE_KINDS,
    DISTRACTOR,
    KINDS,
    PAIRED,
    ClosureAnswer,
    ClosureOutcome,
    Kind,
    Reason,
    closure_answers,
    score_closure,
)
from vigil.sim.privileged import PrivilegedSimulator
from vigil.web.review import ReviewSet

PER_KIND, PER_HOUSE = 2, 3
Reported = Callable[[Episode, Status | None], EpisodeRecord]


@pytest.fixture(scope="module")
def drafts(tmp_path_factory: pytest.TempPathFactory) -> DraftsFile:
    file = DraftsFile(tmp_path_factory.mktemp("drafts") / "drafts.jsonl")
    settings = GenerationSettings(("SI",), seed=9, per_house=PER_HOUSE, tried=14, grammar=CLOSURE_GRAMMAR)
    house, lines = DraftWorker(settings).work(GeneratedHouse(541, "2"), ("SI",))
    with file.writing(settings.header()) as writer:
        writer.add(house, lines)
    return file


def closure_drafts(drafts: DraftsFile) -> list[ClosureDraft]:
    return [task for task in drafts.read().tasks if isinstance(task, ClosureDraft)]


def request(name: str, each: int, *kinds: Kind, max_per_house: int = 3) -> PackRequest:
    """The request for a number of tasks of each kind, or of some kinds."""
    return PackRequest(name, tasks=dict.fromkeys(kinds or KINDS, each), max_per_house=max_per_house)


def answer_of(side: SolvedSide) -> ClosureAnswer:
    assert isinstance(side.answer, ClosureAnswer)
    return side.answer


def frozen(
    out: Path, drafts: DraftsFile, request: PackRequest, reviews: Sequence[Review] = ()
) -> tuple[Pack, dict[str, list[Finding]]]:
    return assemble(out, [drafts], reviews, request, candidate_checker([drafts], VerificationSettings()))


def pool_of(drafts: DraftsFile) -> list[Candidate]:
    return candidates([drafts], [])


@pytest.fixture(scope="module")
def pack(drafts: DraftsFile, tmp_path_factory: pytest.TempPathFactory) -> Pack:
    out = tmp_path_factory.mktemp("packs") / "stress"
    return frozen(out, drafts, request("stress", PER_KIND))[0]


@pytest.fixture(scope="module")
def twins_pack(drafts: DraftsFile, tmp_path_factory: pytest.TempPathFactory) -> Pack:
    """A smaller pack: twins of two kinds, those of which one is impossible among them."""
    out = tmp_path_factory.mktemp("packs") / "twins"
    return frozen(out, drafts, request("twins", PER_KIND, "impossible", "already"))[0]


@pytest.fixture(scope="module")
def answers(pack: Pack) -> dict[str, ClosureAnswer]:
    return closure_answers(pack.folder)


def twins(pack: Pack, answers: dict[str, ClosureAnswer], kind: Kind) -> list[tuple[str, str]]:
    """The ids of the twins of a kind, the side that the families' rules bind first."""
    pairs: dict[str, dict[str, str]] = {}
    for answer in answers.values():
        if answer.kind == kind and answer.pair is not None:
            pairs.setdefault(answer.pair, {})[str(answer.side)] = answer.episode_id
    first, second = PAIRED[kind]
    return [(sides[first], sides[second]) for sides in pairs.values()]


def vigil(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [*map(str, arguments)])


def test_a_pack_holds_each_kind_and_says_so(pack: Pack, answers: dict[str, ClosureAnswer]) -> None:
    assert pack.manifest.suite == "closure"
    assert len(pack.episodes) == len(answers) == PER_KIND * (len(KINDS) + len(PAIRED))
    assert {answer.kind for answer in answers.values()} == set(KINDS)
    assert len({answer.reason for answer in answers.values()} - {None}) == PER_KIND
    card = (pack.folder / "README.md").read_text()
    assert "## Closure stress" in card
    assert "`closure.jsonl`" in card


@pytest.mark.parametrize("kind", PAIRED)
def test_twins_look_alike_to_whoever_is_asked(kind: Kind, pack: Pack, answers: dict[str, ClosureAnswer]) -> None:
    for one, other in twins(pack, answers, kind):
        first, second = pack.episode(one), pack.episode(other)
        assert rendered_sha256(first.instruction, Profile()) == rendered_sha256(second.instruction, Profile())
        assert (first.start, first.max_steps, first.bound_ids()) == (second.start, second.max_steps, second.bound_ids())
        assert first.provenance.template == second.provenance.template
        assert (first.goal == second.goal) is (kind != "if_so")


def test_episodes_say_nothing_of_kind_side_or_twin(pack: Pack, answers: dict[str, ClosureAnswer]) -> None:
    words = {"impossible", "already", "pair", "twin", "absent", "locked", "elsewhere", "closure", "no_fit"}
    for episode in pack.episodes:
        told = episode.model_copy(update={"house": pack.episodes[0].house}).model_dump_json().lower()
        said = {word for word in words if word in told.replace('"is_absent"', "").replace('"is_broken"', "")}
        assert not said, (episode.id, said)


def test_the_pack_is_verified_and_the_same_bytes_again(pack: Pack, drafts: DraftsFile, tmp_path: Path) -> None:
    again, _ = frozen(tmp_path / "again", drafts, request("stress", PER_KIND))
    assert again.sha256 == pack.sha256
    verified = vigil("pack", "verify", pack.folder)
    assert verified.exit_code == 0, verified.output
    assert f"{len(pack.episodes)} of {len(pack.episodes)} episodes" in verified.stdout


def altered(pack: Pack, folder: Path, change: Callable[[dict], dict]) -> Pack:
    """A copy of a pack whose answers are others, under a manifest that has their hash."""
    shutil.copytree(pack.folder, folder)
    rows = [change(json.loads(line)) for line in (folder / ANSWERS).read_text().splitlines()]
    data = "".join(json.dumps(row) + "\n" for row in rows).encode()
    (folder / ANSWERS).write_bytes(data)
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["files"][ANSWERS] = sha256(data).hexdigest()
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return Pack.load(folder)


def verified(pack: Pack) -> list[Finding]:
    """Return the findings about a pack of the suite, as `vigil pack verify` does."""
    return verify_pack(pack, VerificationSettings())


def test_answers_that_the_search_does_not_give_are_found(twins_pack: Pack, tmp_path: Path) -> None:
    assert verified(twins_pack) == []
    changed: list[str] = []

    def with_another_reason(row: dict[str, Any]) -> dict[str, Any]:
        if row["reason"] is None or changed:
            return row
        changed.append(row["reason"])
        return row | {"reason": "locked" if row["reason"] == "absent" else "absent"}

    wrong = altered(twins_pack, tmp_path / "wrong", with_another_reason)
    found = verified(wrong)
    assert {finding.rule for finding in found} == {"closes_correctly"}
    assert len(found) == 1
    assert SUITE_RULES["closes_correctly"] in str(found[0])
    log = tmp_path / "log.jsonl"
    by_command = [vigil("pack", "verify", wrong.folder, "--workers", "2", "--log", log).stdout for _ in range(2)]
    assert str(found[0]) in by_command[0] == by_command[1]
    assert len(log.read_bytes().splitlines()) == len(wrong.episodes)


def test_every_rule_of_the_suite_is_documented() -> None:
    page = (Path(__file__).parents[3] / "docs" / "packs.md").read_text()
    for name, reason in SUITE_RULES.items():
        assert f"| `{name}` | {reason} |" in page


def task_of_reason(drafts: DraftsFile, reason: Reason) -> ClosureTask:
    found = next(task for task in closure_drafts(drafts) if task.answers[-1].reason == reason)
    return task_of([draft.episode for draft in found.drafts], found.answers)


def packaged_task(reason: Reason) -> tuple[ClosureTask, House]:
    """Return the first pair of the packaged suite that is impossible for a reason, and its house."""
    pack = Pack.load("vigil_closure_400")
    answers = closure_answers(pack.folder)
    pair = next(answer.pair for answer in answers.values() if answer.reason == reason)
    sides = [episode for episode in pack.episodes if answers[episode.id].pair == pair]
    return task_of(sides, [answers[episode.id] for episode in sides]), pack.house_of(sides[0])


def test_a_twin_that_is_possible_after_all_is_refused_by_rule(simulator: PrivilegedSimulator) -> None:
    certifier, (task, house) = Certifier(simulator), packaged_task("no_fit")
    first, second = task.episodes
    same = replace(task, episodes=(first, first))
    assert certifier.certify(same, house)[1][0].rule == "twins_differ_in_one"
    change = second.setup.objects[task.removed]
    assert change.placement is not None
    moved = change.placement.position._replace(x=first.start.position.x + 0.4)
    placed = change.model_copy(update={"placement": change.placement.model_copy(update={"position": moved})})
    setup = second.setup.model_copy(update={"objects": {**second.setup.objects, task.removed: placed}})
    aside = replace(task, episodes=(first, second.model_copy(update={"setup": setup})))
    sides, found = certifier.certify(aside, house)
    assert not sides
    assert found[0].rule in {"twin_impossible", "can_be_set_up", "evidence_seen"}


def test_what_bars_the_way_is_in_no_first_frame(simulator: PrivilegedSimulator) -> None:
    certifier, (task, house) = Certifier(simulator), packaged_task("no_fit")
    context = HouseContext(simulator, house, np.random.default_rng(3))
    for episode in task.episodes:
        simulator.reset(episode.start, episode.setup)
        assert PrivilegedView(simulator).state_of(task.removed).visible_px == 0
    for shown in task.episodes:
        context.begin(shown.setup)
        start = context.start_seeing(context.thing(task.removed), (0.7, 4.0), 15.0, shows_px(100))
        assert start is not None
        seen = replace(task, episodes=tuple(each.model_copy(update={"start": start}) for each in task.episodes))
        assert certifier.certify(seen, house)[1][0].rule == "difference_hidden"


def test_what_is_asked_about_is_in_no_first_frame_of_a_second_side(
    drafts: DraftsFile, simulator: PrivilegedSimulator
) -> None:
    found = next(task for task in closure_drafts(drafts) if task.kind == "already")
    task = task_of([draft.episode for draft in found.drafts], found.answers)
    second, house = task.episodes[1], drafts.house(task.episodes[1].house.name)
    context = HouseContext(simulator, house, np.random.default_rng(3))
    context.begin(second.setup)
    start = context.start_seeing(context.thing(task.removed), (0.7, 4.0), 15.0, shows_px(100))
    assert start is not None
    for pose, rules in ((second.start, []), (start, ["hidden_at_start"])):
        simulator.reset(pose, second.setup)
        broken: list[str] = []
        try:
            check_hidden(task, second, PrivilegedView(simulator), is_searched=True)
        except BrokenRule as rule:
            broken.append(rule.rule)
        assert broken == rules


def test_no_mirror_is_in_a_first_frame_that_must_hide_something(simulator: PrivilegedSimulator) -> None:
    house = GeneratedHouse(8, "1").house()
    context = HouseContext(simulator, house, np.random.default_rng(3))
    context.begin(Setup())
    things = simulator.scene().things
    mirror = next(thing.id for thing in things.values() if thing.category == "Mirror")
    start = context.start_seeing(context.thing(mirror), (0.7, 4.0), 15.0, shows_px(100))
    assert start is not None
    simulator.reset(start, Setup())
    view = PrivilegedView(simulator)
    hidden = next(thing for thing in things if not view.state_of(thing).visible_px)
    asked = builders.episode("SI", goal=builders.episode("SI").goal.model_copy(update={"object_id": hidden}))
    task = ClosureTask("already", (asked,), hidden)
    with pytest.raises(BrokenRule, match="mirror"):
        check_hidden(task, asked, view, is_searched=True)
    check_hidden(task, asked, view, is_searched=False)


def test_a_door_that_heavy_furniture_bars_is_locked(simulator: PrivilegedSimulator) -> None:
    house = GeneratedHouse(516, "2").house()
    context = HouseContext(simulator, house, np.random.default_rng(1))
    certifier = Certifier(simulator)
    for task in islice(impossible(context), 40):
        if isinstance(task, ClosureTask) and "blocker" in task.episodes[0].bindings:
            sides, found = certifier.certify(task, house)
            if not found:
                break
    else:
        pytest.fail("no twins with a barred door")
    assert answer_of(sides[1]).reason == "locked"
    assert answer_of(sides[1]).accepted == ("fail", "invalid")
    simulator.reset(task.episodes[1].start, task.episodes[1].setup)
    assert simulator.scene().things[task.removed].category in BLOCKERS


def test_the_obvious_act_is_refused_by_a_swing_a_machine_and_a_full_shelf(simulator: PrivilegedSimulator) -> None:
    context = HouseContext(simulator, GeneratedHouse(515, "2").house(), np.random.default_rng(2))
    tasks = [task for task in islice(silent_refusal(context), 30) if isinstance(task, ClosureTask)]
    assert {task.form for task in tasks} == {"swing", "machine", FULL}


def test_twins_about_everything_somewhere_mean_just_what_may_be_on_or_open_there(
    drafts: DraftsFile, simulator: PrivilegedSimulator
) -> None:
    found = next(task for task in closure_drafts(drafts) if task.answers[0].form in EVERYTHING_FORMS)
    task = task_of([draft.episode for draft in found.drafts], found.answers)
    first, second = task.episodes
    house, certifier = drafts.house(first.house.name), Certifier(simulator)
    assert isinstance(first.goal, AllOf)
    assert first.goal == second.goal
    assert first.goal.object_id == task.removed
    simulator.load(house)
    simulator.reset(first.start, first.setup)
    assert PrivilegedView(simulator).state_of(task.removed).visible_px == 0
    assert {each.object_id for each in task.evidence} == {part.object_id for part in first.goal.parts}
    _, tour = found.drafts
    assert MIN_LOOKING_SHARE * first.max_steps <= len(tour.actions) <= BUDGET_SHARE * first.max_steps
    places = [HOME, *(f"the {name}" for name in ROOM_NAMES.values())]
    place = next(name for name in places if name in first.instruction)
    other = next(name for name in places[1:] if name != place)
    elsewhere = tuple(
        each.model_copy(update={"instruction": each.instruction.replace(place, other)}) for each in task.episodes
    )
    assert certifier.certify(replace(task, episodes=elsewhere), house)[1][0].rule == "distinguished"


def test_a_broken_machine_is_read_from_near_by_and_does_not_start(
    drafts: DraftsFile, simulator: PrivilegedSimulator
) -> None:
    task = task_of_reason(drafts, "broken")
    house = drafts.house(task.episodes[0].house.name)
    sides, found = Certifier(simulator).certify(task, house)
    assert not found
    answer = answer_of(sides[1])
    assert answer.accepted[0] == "fail"
    assert answer.evidence[0].within_m == NOTICE_READABLE_M
    assert answer.certificate is not None
    assert "out of order" in answer.certificate.refusal
    played = Validator(simulator).play(task.episodes[1], house, sides[0].actions)
    refusals = {step.effect.refusal for step in played.steps if step.effect is not None}
    assert "out_of_order" in refusals
    verdict = score_closure(answer, task.episodes[1], played)
    assert (verdict.C, verdict.label) == (False, "false_success")
    assert verdict.is_refused


@pytest.fixture(scope="module")
def reported(pack: Pack, simulator: PrivilegedSimulator) -> Reported:
    """The record of an agent that reports at once, or of one that never does."""
    validator, played = Validator(simulator), dict[tuple[str, Status], EpisodeRecord]()

    def record(episode: Episode, status: Status | None) -> EpisodeRecord:
        key = episode.id, status or "success"
        if key not in played:
            played[key] = validator.play(episode, pack.house_of(episode), [Report(status=key[1], summary="")])
        if status is not None:
            return played[key]
        return played[key].model_copy(update={"steps": (), "end": "fail_no_report"})

    return record


@pytest.mark.parametrize("agent", BLIND)
def test_agents_without_sight_are_at_chance_on_pairs(
    agent: str, pack: Pack, answers: dict[str, ClosureAnswer], reported: Reported
) -> None:
    told = guessing(list(answers.values()))[agent]
    closed: dict[str, list[bool]] = {kind: [] for kind in KINDS}
    for episode in pack.episodes:
        for status in BLIND[agent]:
            verdict = score_closure(answers[episode.id], episode, reported(episode, status))
            closed[answers[episode.id].kind].append(verdict.C)
    assert {f"C {kind}": round(100 * sum(found) / len(found), 1) for kind, found in closed.items()} == {
        f"C {kind}": told[f"C {kind}"] for kind in KINDS
    }


@pytest.mark.parametrize("kind", ["already", "if_so"])
def test_who_does_the_same_on_both_sides_closes_no_pair_knowingly(
    kind: Kind, pack: Pack, answers: dict[str, ClosureAnswer], simulator: PrivilegedSimulator
) -> None:
    validator = Validator(simulator)

    def closed(name: str, by_solution_of: str) -> ClosureOutcome:
        episode = pack.episode(name)
        record = validator.play(episode, pack.house_of(episode), pack.solutions[by_solution_of].actions)
        return score_closure(answers[name], episode, record)

    for names in twins(pack, answers, kind):
        assert all(closed(name, name).is_knowing for name in names)
        for solved in names:
            same = [closed(name, solved) for name in names]
            assert not all(each.is_knowing for each in same)
            if kind == "already" and solved == names[0]:
                assert all(each.C for each in same)


@pytest.mark.parametrize("kind", PAIRED)
def test_no_agent_without_sight_closes_both_twins_of_a_kind(kind: Kind, answers: dict[str, ClosureAnswer]) -> None:
    told = guessing(list(answers.values()))
    assert {agent: told[agent][f"pairs {kind}"] for agent in BLIND} == dict.fromkeys(BLIND, 0.0)


def test_too_few_tasks_are_an_error_that_counts_them(drafts: DraftsFile) -> None:
    pool = pool_of(drafts)
    with pytest.raises(EpisodeError, match=r"all_of 3 of 9 \(of 3 drafts\).*impossible 3 of 9.*look_alike 3 of 9"):
        select(pool, request("p", 9))
    two = request("p", PER_KIND)
    assert select(pool, two) == select(pool[::-1], two)
    with pytest.raises(EpisodeError, match="all_of 1 of 2"):
        select(pool, request("p", 2, max_per_house=1))


def test_kinds_have_quotas_and_forms_are_shared_out(drafts: DraftsFile) -> None:
    pool = pool_of(drafts)

    def chosen_of(tasks: Mapping[Kind, int]) -> list[ClosureDraft]:
        found = [candidate.task for candidate in select(pool, PackRequest("p", tasks=tasks))]
        return [task for task in found if isinstance(task, ClosureDraft)]

    chosen = chosen_of({"impossible": 3, "already": 2, "if_so": 1})
    assert Counter(task.kind for task in chosen) == {"impossible": 3, "already": 2, "if_so": 1}
    assert len({task.answers[-1].reason for task in chosen if task.kind == "impossible"}) == 3
    alike = chosen_of({"look_alike": 2})
    assert {task.answers[0].form for task in alike} == {"place", "state"}
    made_sure = chosen_of({"already": 2})
    assert {task.answers[0].form for task in made_sure} == {"one_thing", "closed_home"}


def review_of(episode: Episode, verdict: Verdict, instruction: str | None = None) -> Review:
    return Review(
        at=datetime(2026, 11, 23, tzinfo=UTC),
        reviewer="ada",
        episode_id=episode.id,
        episode_sha256=episode_sha256(episode),
        verdict=verdict,
        instruction=instruction,
    )


def test_twins_are_rejected_together_and_approved_tasks_enter_first(drafts: DraftsFile, tmp_path: Path) -> None:
    pool = [task for task in closure_drafts(drafts) if task.kind == "already"]
    rejected, approved = pool[0].drafts[1].episode, pool[2].drafts[0].episode
    reviews = [review_of(rejected, "reject"), review_of(approved, "approve")]
    pack, bad = frozen(tmp_path / "p", drafts, request("p", 1, "already"), reviews)
    assert not bad
    assert approved.id in {episode.id for episode in pack.episodes}
    assert pack.manifest.meta["reviews"] == {"person": 1, "model": 0, "none": 1, "rejected": 2}
    with pytest.raises(EpisodeError, match=r"already 2 of 3 \(of 2 drafts\)"):
        frozen(tmp_path / "q", drafts, request("q", 3, "already"), reviews)


def test_words_given_to_one_twin_are_those_of_both_and_are_certified(
    drafts: DraftsFile,
) -> None:
    task = next(task for task in closure_drafts(drafts) if task.answers[0].form == "one_thing")
    first = task.drafts[0].episode
    check = candidate_checker([drafts], VerificationSettings())

    def worded(instruction: str) -> Candidate:
        pool = candidates([drafts], [review_of(first, "edit", instruction)])
        assert sum(each.is_reworded for each in pool) == 1
        return next(each for each in pool if each.episode.id == first.id)

    polite = worded(f"Please. {first.instruction}")
    assert {draft.episode.instruction for draft in polite.task.drafts} == {f"Please. {first.instruction}"}
    assert check([polite]) == {}
    (found,) = check([worded("Open the sesame.")]).values()
    assert {finding.rule for finding in found} == {"target_named"}


def test_drafts_of_the_suite_are_reviewed_with_what_closes_them(drafts: DraftsFile) -> None:
    found = ReviewSet.of_drafts(drafts.path)
    task = next(task for task in closure_drafts(drafts) if task.kind == "impossible")
    assert len(found.episodes) == sum(len(task.drafts) for task in closure_drafts(drafts))
    told = found.expected_reports[task.drafts[1].episode.id]
    assert told.startswith(f"impossible, impossible, {task.answers[1].reason}")
    assert "its twin" in told


def test_what_was_proposed_in_vain_is_counted_by_rule(drafts: DraftsFile) -> None:
    proposed = drafts.read()
    refused = {line.rule for line in proposed.rejections}
    assert refused == set(proposed.done[0].rejected)
    assert all(isinstance(line, Rejection) for line in proposed.rejections)
    assert proposed.done[0].kept == len([line for line in proposed.tasks if isinstance(line, ClosureDraft)])


def test_a_silent_refusal_is_met_by_whoever_goes_straight_for_it(
    pack: Pack, answers: dict[str, ClosureAnswer], simulator: PrivilegedSimulator
) -> None:
    for answer in answers.values():
        if answer.kind == "silent_refusal":
            episode = pack.episode(answer.episode_id)
            solved = [action for action in pack.solutions[episode.id].actions if isinstance(action, InteractPixel)]
            assert len(solved) > 1
            if answer.form == FULL:
                continue
            assert episode.goal.constraint is not None
            simulator.load(pack.house_of(episode))
            simulator.reset(episode.start, episode.setup)
            straight = MacroActions(PrivilegedView(simulator), may_tilt=True, is_exhaustive=True)
            assert not is_doable(episode.goal, straight)


def test_look_alikes_differ_in_colour_and_the_wrong_one_is_told(simulator: PrivilegedSimulator) -> None:
    house = GeneratedHouse(502, "living-room").house()
    context = HouseContext(simulator, house, np.random.default_rng(7))
    task = next(each for each in look_alike(context) if isinstance(each, ClosureTask))
    episode = task.episodes[0]
    alike, target = episode.bindings[DISTRACTOR], episode.bindings["target"]
    items = context.items
    assert items[alike].category == items[target].category
    assert set(items[alike].colours).isdisjoint(items[target].colours)
    sides, found = Certifier(simulator).certify(task, house)
    assert not found
    record = Validator(simulator).play(episode, house, sides[0].actions)
    verdict = score_closure(answer_of(sides[0]), episode, record)
    assert verdict.C
    assert not verdict.is_wrong_object
    swapped = {alike: target, target: alike}
    worlds = [
        world.model_copy(update={"objects": {swapped.get(name, name): each for name, each in world.objects.items()}})
        for world in record.worlds
    ]
    steps = tuple(
        step.model_copy(update={"world": world}) for step, world in zip(record.steps, worlds[1:], strict=True)
    )
    wrong = score_closure(
        answer_of(sides[0]), episode, record.model_copy(update={"initial": worlds[0], "steps": steps})
    )
    assert wrong.is_wrong_object
    assert wrong.is_false_success


def test_exemptions_are_rules_of_the_families() -> None:
    broken = [rules for kind in CLOSURE_KINDS.values() for rules in kind.exempt.values()]
    assert set().union(*broken) <= set(RULES)


def test_a_run_is_reported_in_a_section_of_its_own(pack: Pack, tmp_path: Path) -> None:
    for agent in ("always_fail", "solver", "acts_anyway"):
        played = vigil("run", "--pack", pack.folder, "--agent", agent, "--log-dir", tmp_path / agent, "--workers", "1")
        assert played.exit_code == 0, played.output
    alone = vigil("report", tmp_path / "always_fail")
    assert alone.exit_code == 0, alone.output
    assert "## Closure stress: C, correct closure" in alone.stdout
    assert "## Findings at a glance" not in alone.stdout
    written = vigil("report", *sorted(tmp_path.iterdir()), "--out", tmp_path / "out", "--format", "all")
    assert written.exit_code == 0, written.output
    told = json.loads((tmp_path / "out" / "report.json").read_text())["tables"]
    assert set(told) == {
        *("closure_kinds", "closure_forms", "closure_labels", "closure_pairs", "closure_impossible"),
    }
    pairs = {(str(row["run"]).split()[0], row["kind"]): row for row in told["closure_pairs"]["rows"]}
    assert pairs["always_fail", "impossible"]["right"] == 0.0
    assert pairs["always_fail", "impossible"]["auc"] == 50.0
    assert pairs["solver", "impossible"]["right"] == 100.0
    assert (pairs["acts_anyway", "already"]["right"], pairs["solver", "already"]["right"]) == (0.0, 100.0)
    forms = [row for row in told["closure_forms"]["rows"] if str(row["run"]).startswith("acts_anyway")]
    assert {(row["C"], row["knowing"]) for row in forms if row["form"] == "already one_thing"} == {(100.0, 0.0)}
    refused = vigil("figure", "plane", tmp_path / "solver", "--out", tmp_path / "plane.png")
    assert "suite 'closure'" in str(refused.exception)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["propose", "--suite", "closure", "--seeds", "1:2", "--family", "SI", "--out", "d.jsonl"], "--family exclude"),
        (["propose", "--suite", "closure", "--seeds", "1:2", "--model", "a/b", "--out", "d.jsonl"], "--model exclude"),
        (
            ["build", "--suite", "closure", "--earlier-drafts", "a", "--name", "n", "--out", "o"],
            "--earlier-drafts exclude",
        ),
        (
            ["make", "--suite", "closure", "--name", "n", "--seed", "1", "--one-family-per-house", "--out", "o"],
            "--one-family-per-house exclude",
        ),
        (["make", "--name", "n", "--seed", "1", "--kind", "already", "--out", "o"], "--kind is for a suite"),
        (["make", "--suite", "closure", "--name", "n", "--seed", "1", "--kind", "alredy", "--out", "o"], "'already'"),
    ],
)
def test_options_that_a_suite_does_not_have_are_refused(arguments: list[str], words: str) -> None:
    refused = vigil("pack", *arguments)
    assert isinstance(refused.exception, InputError)
    assert words in str(refused.exception)
