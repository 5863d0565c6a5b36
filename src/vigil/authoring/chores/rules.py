"""Rules about lists: their sentences, the states of their objects at the start, the order of their text, and whether
objects can be recognized where they are picked up."""

from collections.abc import Iterator, Sequence
from functools import cached_property

from vigil.assets.catalog import CATALOG
from vigil.authoring.chores.proposed import MAX_SEARCHED, other_drawers
from vigil.authoring.chores.sentences import EVERY_DRAWER
from vigil.authoring.closure.certify import faults_of_gaps
from vigil.authoring.language.disambiguation import confusable
from vigil.authoring.language.referring import DescribedThing, Phrase, mentions, resolve_mentions
from vigil.authoring.language.wording import asks_inside
from vigil.authoring.review.containers import not_found_by_opening
from vigil.authoring.review.episode_start import EpisodeStart
from vigil.authoring.review.robustness import shows_one_wall
from vigil.authoring.review.rules import RULES
from vigil.authoring.review.wording_rules import worded_badly
from vigil.authoring.solving.chore_order import ChoreModel, length_of
from vigil.authoring.solving.chores import MIN_PICKED_PX, ChorePlan
from vigil.authoring.solving.goal_actions import closed_containers_around, is_doable
from vigil.authoring.solving.macro_actions import MacroActions
from vigil.base.numbered_list import read_list
from vigil.packs.pack import CHORES_SUITE, protocol_faults
from vigil.protocol.actions import InteractPixel
from vigil.protocol.episode import Episode
from vigil.protocol.goals import Chore, Chores, ObjectAtReceptacle, ObjectInState, ReportStatus
from vigil.records.record import EpisodeRecord
from vigil.scene.supports import drawers_of
from vigil.scene.things import Thing
from vigil.scoring.chore_answers import ChoreAnswer

LONGER = 1.25
"""Minimum length of the walk in text order, as a multiple of the shortest walk."""
BrokenRules = Iterator[tuple[str, str]]


def faults_of_start(case: EpisodeStart) -> BrokenRules:
    """Yield (rule, message) for the faults of a list's budgets, start pose and first frame."""
    yield from (("protocol", fault) for fault in protocol_faults(case.episode, CHORES_SUITE))
    yield from (("start_free", fault) for fault in RULES["start_free"].faults(case))
    if shows_one_wall(case):
        yield "more_than_a_wall", "the first frame shows one wall"


class _SentenceStart(EpisodeStart):
    """The start of a list, with only one of its sentences as the instruction. The sentence may name absent things."""

    @cached_property
    def mentioned(self) -> list[tuple[Phrase, list[DescribedThing]]]:
        """Each phrase of the sentence, with the things that it could mean."""
        things = self.view.scene.things
        absent = [CATALOG[things[each].category].display_name for each in self.episode.goal.ids() - self.items.keys()]
        phrases = mentions(self.episode.instruction, [*(item.name for item in self.items.values()), *absent])
        return list(zip(phrases, resolve_mentions(phrases, self.items.values()), strict=True))


def _sentence_start(case: EpisodeStart, sentence: str) -> EpisodeStart:
    return _SentenceStart(case.episode.model_copy(update={"instruction": sentence}), case.house, case.view)


def faults_of_words(case: EpisodeStart) -> BrokenRules:
    """Yield (rule, message) for each sentence that, parsed by itself, does not mean the objects of its chore."""
    goal = case.episode.goal
    assert isinstance(goal, Chores)
    for number, (line, chore) in enumerate(zip(read_list(case.episode.instruction), goal.chores, strict=True), start=1):
        alone = _sentence_start(case, line)
        yield from ((rule, f"chore {number}: {fault}") for rule, fault in _faults_of_line(alone, chore))


def _faults_of_line(case: EpisodeStart, chore: Chore) -> BrokenRules:
    things = case.view.scene.things
    meant = {each for each in chore.ids() if things[each].is_present}
    read: set[str] = set()
    for phrase, items in case.mentioned:
        if len(items) > 1 or (not items and len(meant) == len(chore.ids())):
            yield "distinguished", f"{str(phrase)!r} fits {len(items)} things"
        read |= {item.id for item in items}
    if EVERY_DRAWER in case.episode.instruction.lower():
        read = {drawer.id for each in read for drawer in drawers_of(case.view.scene, things[each])}
    if read != meant:
        yield "distinguished", f"the sentence means {', '.join(sorted(read)) or 'nothing'}"
    for other in other_drawers(case.view.scene, case.items, [phrase for phrase, _ in case.mentioned]):
        yield "distinguished", f"the sentence may also mean a drawer of {other!r}"
    for part in chore.parts:
        if isinstance(part, ObjectAtReceptacle):
            if part.inside != asks_inside(case.episode.instruction):
                yield "inside_in_words", f"the goal wants it {'inside' if part.inside else 'on'} {part.receptacle_id!r}"
            if things[part.object_id].is_present:
                yield from _faults_of_place(case, part)
    yield from worded_badly(case)


def _faults_of_place(case: EpisodeStart, part: ObjectAtReceptacle) -> BrokenRules:
    """Yield faults if an object lies in a closed container, its phrase does not name it, and the search is unfair."""
    phrases = [phrase for phrase, items in case.mentioned if [item.id for item in items] == [part.object_id]]
    if closed_containers_around(case.view, part.object_id) and not any(phrase.support for phrase in phrases):
        thing = case.view.scene.things[part.object_id]
        for fault in not_found_by_opening(case.view, case.items, thing, phrases, MAX_SEARCHED):
            yield "not_shut_away", f"{part.object_id!r} lies in a closed container: {fault}"


def absent_phrases(case: EpisodeStart, number: int) -> list[Phrase]:
    """Return the phrases of a chore's sentence that fit no thing in the house."""
    line = read_list(case.episode.instruction)[number - 1]
    alone = _sentence_start(case, line)
    return [phrase for phrase, items in alone.mentioned if not items]


def faults_of_states(case: EpisodeStart, answers: Sequence[ChoreAnswer]) -> BrokenRules:
    """Yield (rule, message) for each chore whose state at the start does not fit its kind."""
    goal, model = case.episode.goal, ChoreModel(case.view.scene)
    assert isinstance(goal, Chores)
    is_any_undone = False
    for number, (chore, answer) in enumerate(zip(goal.chores, answers, strict=True), start=1):
        is_done = model.is_done(chore, model.initial)
        is_any_undone |= not is_done and answer.is_possible
        if answer.kind == "already" and not is_done:
            yield "holds_already", f"chore {number}: it does not hold at the start"
        if answer.kind not in ("already", "order", "question") and is_done:
            yield "goal_unmet", f"chore {number}: it holds at the start"
        if chore.condition is not None and model.holds(chore.condition, model.initial) != chore.is_met:
            yield "condition_judged", f"the condition of chore {number} is not as its goal says"
        yield from ((rule, f"chore {number}: {fault}") for rule, fault in _faults_of_kind(case, chore, answer))
    if not is_any_undone:
        yield "goal_unmet", "nothing is left to do"
    states = [part for chore in goal.chores for part in chore.parts if isinstance(part, ObjectInState | ReportStatus)]
    yield from faults_of_gaps(case.view, sorted({part.object_id for part in states if part.state == "is_open"}))


def _faults_of_kind(case: EpisodeStart, chore: Chore, answer: ChoreAnswer) -> BrokenRules:
    items, thing = case.items, case.view.scene.things[chore.parts[0].object_id]
    if answer.distractor is not None:
        others = {item.id for item in confusable(items[thing.id], items.values())} if thing.is_present else set[str]()
        if answer.distractor not in others:
            yield "distinguished", f"{answer.distractor!r} cannot be taken for {thing.id!r}"
    if answer.kind == "hidden" and not closed_containers_around(case.view, thing.id):
        yield "not_shut_away", f"{thing.id!r} does not lie in a closed container"
    if answer.kind == "refused" and not (_is_interlocked(thing) or _is_blocked(case, chore)):
        yield "refused_at_first", f"nothing refuses the act on {thing.id!r}"


def _is_interlocked(thing: Thing) -> bool:
    """Return whether a machine runs, and so refuses to open, or is open, and so refuses to start."""
    return CATALOG[thing.category].runs_only_when_closed and (thing.is_toggled or thing.openness > 0.0)


def _is_blocked(case: EpisodeStart, chore: Chore) -> bool:
    """Return whether, at the start, a chore's act fails from every place."""
    part = chore.parts[0]
    macro_actions = MacroActions(case.view, may_tilt=True, is_exhaustive=True)
    return isinstance(part, ObjectInState) and not is_doable(part, macro_actions)


def faults_of_order(plan: ChorePlan, answers: Sequence[ChoreAnswer]) -> BrokenRules:
    """Yield (rule, message) if the text order helps the agent, or if answers misstate how chores affect each other."""
    before, count = plan.entanglement.before, len(answers)
    if before and all(a < b for a, b in before):
        yield "text_order_does_not_help", "the order of the text works"
    if length_of(plan.lengths, range(count)) < LONGER * plan.walk_m:
        yield "text_order_does_not_help", "the order of the text is almost the shortest one"
    ordered = {place for pair in before for place in pair}
    for place, answer in enumerate(answers):
        if (answer.kind == "order") != (place in ordered):
            yield "entangled_as_answered", f"chore {place + 1} is of kind {answer.kind}"


def faults_of_picks(episode: Episode, record: EpisodeRecord) -> BrokenRules:
    """Yield a fault for each object of which few pixels are in view when the solver picks it up.

    Of an object that the list does not concern, no pixels are recorded.
    """
    goal = episode.goal
    assert isinstance(goal, Chores)
    for before, step in zip(record.worlds, record.steps, strict=False):
        thing_id = None if step.effect is None else step.effect.hit
        if isinstance(step.action, InteractPixel) and step.action.intent == "pick" and thing_id is not None:
            pixels = before.objects[thing_id].visible_px if thing_id in before.objects else 0
            if pixels < MIN_PICKED_PX:
                of = [f"chore {n}: " for n, chore in enumerate(goal.chores, start=1) if thing_id in chore.ids()]
                yield "seen_where_picked", f"{''.join(of[:1])}{thing_id!r} is picked up where it shows {pixels} pixels"
