"""Drafts of Sequential Manipulation (SM): starts and instructions for plans (`vigil.authoring.families.sm.plans`)."""

from collections import defaultdict
from collections.abc import Callable
from functools import partial
from pathlib import Path

from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.proposals import CLEAR_PX, Drafts, act_of, shows_px
from vigil.authoring.families.sm.plans import Plans, SequencePlan
from vigil.authoring.language.referring import Phrase
from vigil.authoring.language.sentences import Forms, read_sentences
from vigil.authoring.language.wording import asks_inside, opening_phrase, order_slots, pronoun_slots, say
from vigil.base.geometry import Pose
from vigil.protocol.family import DEFAULT_HORIZON_DEG
from vigil.protocol.goals import ObjectAtReceptacle, ObjectInState

SEQUENCES = read_sentences(Path(__file__).with_name("sequences.toml"))
"""Template -> its sentence forms. `put_into_closed` is for `put_into` if the receptacle is closed at the start."""
CHAINS = read_sentences(Path(__file__).with_name("chains.toml"))
"""Template of a longer sequence -> its sentence forms."""
START_AWAY_M = (0.7, 4.0)
"""Minimum and maximum distance (m) between the start and the first object to act on."""
_INSIDE = {"into": "into", "in_": "in"}
"""Name of a slot -> its word if the object is put inside."""
MOVED = ("target", "second")
"""Roles of objects that are moved. Their phrases must not name a room, which could be read as the destination."""


def drafts_of(context: HouseContext, plans: Callable[[HouseContext], Plans]) -> Drafts:
    """Yield a draft for each plan for which a start pose and phrases are found."""
    for plan in plans(context):
        found = context.start_and_phrases(plan.setup, plan.roles, partial(_start, context, plan))
        if found is None:
            continue
        start, named = found
        yield context.draft(
            "SM",
            TaskSpec(
                start=start,
                setup=plan.setup,
                instruction=_instruction(context, plan, named),
                goal=plan.goal,
                bindings={role: thing.id for role, thing in plan.roles.items()},
                template=plan.template,
            ),
        )


def _start(context: HouseContext, plan: SequencePlan, named: dict[str, Phrase]) -> Pose | None:
    """Return a start from which the first object to act on is visible.

    None if there is no such start, a phrase is missing, or the phrases are too much for one sentence (`is_wordy`).
    """
    if len(named) < len(plan.roles) or is_wordy(named):
        return None
    first = context.thing(plan.facts[0].object_id)
    return context.start_seeing(first, START_AWAY_M, DEFAULT_HORIZON_DEG, shows_px(CLEAR_PX))


def _instruction(context: HouseContext, plan: SequencePlan, named: dict[str, Phrase]) -> str:
    """Return a random sentence for a plan; `named` has the phrase for each role."""
    words = {role: str(phrase) for role, phrase in named.items()}
    words |= pronoun_slots(plan.roles["target"].category, "target_")
    states = {fact.object_id: fact for fact in plan.facts if isinstance(fact, ObjectInState)}
    for name, role in (("order_a", "first"), ("order_b", "next")):
        if role in plan.roles:
            thing = plan.roles[role]
            words[name] = order_slots(act_of(states[thing.id]), thing.category, words[role], context.rng)["order"]
    opened = [role for role in ("container", "receptacle") if role in plan.roles and plan.roles[role].id in states]
    parts = [opening_phrase(plan.roles[role].category, words[role]) for role in opened]
    words |= parts[0].slots() if parts else {}
    words |= {"other": parts[1].whole} if len(parts) > 1 else {}
    inside = any(isinstance(fact, ObjectAtReceptacle) and fact.inside for fact in plan.facts)
    if plan.template in CHAINS:
        words["into"] = "into" if inside else "onto"
        return context.say(CHAINS[plan.template], **words)
    is_in_room = "receptacle" in named and named["receptacle"].room is not None
    words |= {"into": "into", "in_": "into" if is_in_room else "in"} if inside else {"into": "on", "in_": "on"}
    key = "put_into_closed" if opened == ["receptacle"] else plan.template
    return say(sequence_forms(key, context.forms, inside=inside), context.rng, **words)


def sequence_forms(template: str, forms: Forms, *, inside: bool) -> tuple[str, ...]:
    """Return the sentence forms of a template; if `inside`, only forms that ask to put the object inside."""
    sentences = SEQUENCES[template].of(forms)
    return tuple(each for each in sentences if not inside or asks_inside(each.format_map(defaultdict(str, _INSIDE))))


def is_wordy(phrases: dict[str, Phrase]) -> bool:
    """Return whether these phrases (by role) are too much for one sentence.

    This is so if a phrase names a support, if the phrase for a moved object names a room, or if two phrases name the
    same room.
    """
    rooms = [phrase.room for phrase in phrases.values() if phrase.room is not None]
    is_placed = any(phrase.support is not None for phrase in phrases.values())
    is_moved = any(phrases[role].room is not None for role in MOVED if role in phrases)
    return is_placed or is_moved or len(set(rooms)) < len(rooms)
