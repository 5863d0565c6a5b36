"""The rules about the wording of drafts, each with its name and its reason. They exclude faults that readers found.

They apply only to new drafts: frozen packs may be older than the rules, and `vigil pack verify` does not check them.
The built-in grammar is written so that it satisfies most of them; they also apply to proposals of language models.
"""

import re
from collections.abc import Iterator

from vigil.authoring.language.referring import BETWEEN, ROOM_NAMES, DescribedThing, Phrase, items_as_seen, referents
from vigil.authoring.review.episode_start import EpisodeStart
from vigil.authoring.review.rules import Faults, Rule, binds, every_family
from vigil.protocol.families import FAMILIES
from vigil.protocol.goals import ObjectHeld

VAGUE = re.compile(
    r"\b(clear(?:ly)?|well in view|in front of you|good (?:view|look)|close by|close to|nearby|near by)\b"
)
"""Pattern of words that are too vague for an agent to check whether they apply."""
_ROOMS = "|".join(ROOM_NAMES.values())
STACKED = re.compile(
    rf"\b(?:put|place|placed|leave)\b[^.;]*? in the [\w -]+? in the (?:{_ROOMS})\b|"
    rf"\bin the (?:{_ROOMS}) (?:in|into|on|onto) (?:the|your)\b"
)
"""Pattern of two places in succession: "put it in the sink in the kitchen", "the stool in the bedroom in your hand"."""
ONE_PAIR = re.compile(r"\bpair of \w+,? (?:which|that) \w+s\b|\bpair of \w+\b[^.;]*?\b(?:pick|put|move|take|find) it\b")
"""Pattern of "pair of" things with a verb or pronoun in the singular ("a pair of boots that stands")."""
ASIDE = re.compile(r"\b(?:aside|away|down|elsewhere|somewhere else|out of the way)\b")
"""Pattern of words that say where an obstacle is put, so that the hand is free afterwards."""


def _stop(case: EpisodeStart) -> Faults:
    said = case.episode.instruction.lower()
    vague = VAGUE.search(said)
    if vague is not None:
        yield f"the instruction says {vague[0]!r}, which cannot be checked"
    elif not re.search(FAMILIES[case.episode.family].end_words or "", said):
        yield "the instruction does not say when an agent is done"


def _second_answers(case: EpisodeStart) -> Faults:
    things = items_as_seen(case.view.scene)
    for phrase, meant in case.mentioned:
        others = [item.id for item in referents(phrase, things.values()) if phrase.name in item.alternative_names]
        if len(meant) == 1 and others:
            yield f"{str(phrase)!r} also fits {others[0]!r}, by its appearance"


def _names(case: EpisodeStart) -> Faults:
    for phrase, item in _meant(case):
        if item.has_misleading_name and BETWEEN not in item.name:
            yield f"people do not call {item.id!r} in the {item.room} {str(phrase.without_place)!r}"


def _rooms(case: EpisodeStart) -> Faults:
    for phrase, item in _meant(case):
        joined = item.has_misleading_name and BETWEEN in phrase.name
        if joined or (phrase.room is not None and not item.is_room_one):
            yield f"{str(phrase)!r} names a room of which the home has several"


def _shelves(case: EpisodeStart) -> Faults:
    for _, item in _meant(case):
        said = rf"\b{re.escape(item.name)}\b[^.,;]*? (?:in|inside) the {re.escape(item.support or '')}\b"
        if item.is_on_shelf and re.search(said, case.episode.instruction):
            yield f"{item.id!r} lies on a shelf of the {item.support}, not in it"


def _colours(case: EpisodeStart) -> Faults:
    for phrase, item in _meant(case):
        if phrase.colour is not None and case.items[item.id].colours and phrase.colour not in item.colours:
            yield f"{str(phrase)!r}: most of what is visible of {item.id!r} has another colour"


def _needless(case: EpisodeStart) -> Faults:
    things = items_as_seen(case.view.scene)
    for phrase, item in _meant(case):
        if phrase.colour is not None and referents(Phrase(phrase.name), things.values()) == [item]:
            yield f"{str(phrase)!r} names a colour, but there is only one {phrase.name}"


def _stacked(case: EpisodeStart) -> Faults:
    found = STACKED.search(case.episode.instruction)
    if found is not None:
        yield f"two places follow each other: {found[0]!r}"


def _number(case: EpisodeStart) -> Faults:
    found = ONE_PAIR.search(case.episode.instruction)
    if found is not None:
        yield f"a pair is in the singular: {found[0]!r}"


def _hand(case: EpisodeStart) -> Faults:
    goal = case.episode.goal
    is_moved = goal.constraint is not None and goal.constraint.kind == "object_moved"
    is_explicit = "obstacle" in case.episode.bindings and len(case.mentioned) > 1
    if is_moved and is_explicit and isinstance(goal, ObjectHeld) and not ASIDE.search(case.episode.instruction):
        yield "the hand must take the target, but the instruction does not say that the obstacle is put aside"


def _meant(case: EpisodeStart) -> list[tuple[Phrase, DescribedThing]]:
    """Return each phrase that refers to exactly one thing, with the visible features of that thing."""
    things = items_as_seen(case.view.scene)
    return [(phrase, things[meant[0].id]) for phrase, meant in case.mentioned if len(meant) == 1]


WORDING_RULES: dict[str, Rule] = {
    "stop_can_be_checked": Rule(None, "an agent can check, by what it sees or reaches, that the task is done", _stop),
    "no_second_answer": Rule(
        every_family,
        "a phrase fits no other object by its looks, e.g. a counter with doors for a cabinet",
        _second_answers,
    ),
    "called_as_it_looks": Rule(
        every_family, "objects have the names that people use, e.g. not countertop for a worktop in a bathroom", _names
    ),
    "one_such_room": Rule(every_family, "a room is named only if the home has one with that name", _rooms),
    "on_a_shelf": Rule(every_family, "an object on an open shelf is not said to lie in the furniture", _shelves),
    "colour_of_the_whole": Rule(
        every_family, "a colour is that of the whole object, not only of its legs or label", _colours
    ),
    "no_needless_colour": Rule(every_family, "a colour is named only if the name is not enough", _needless),
    "no_stacked_places": Rule(
        every_family, "two places do not follow each other, because people misread them", _stacked
    ),
    "pairs_are_plural": Rule(every_family, "pairs are plural, e.g. pick up the boots", _number),
    "hand_is_freed": Rule(None, "an instruction to pick up an obstacle also says to put it aside", _hand),
}
"""Rule name -> rule, in the order in which they are checked."""


def worded_badly(case: EpisodeStart) -> Iterator[tuple[str, str]]:
    """Yield (rule, message) for each fault of a draft's wording."""
    for name, rule in WORDING_RULES.items():
        if binds(rule, name, case.episode.family):
            yield from ((name, message) for message in rule.faults(case))
