"""Proposals by a language model, which gets the list of a house's things and a family's description.

The model chooses the kind, the objects and the words. The start pose and the setup are found in the same way as for the
grammar, and the same rules apply. A reply that cannot be parsed, and a task that cannot be set up, become rejections
with a reason.
"""

import json
from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from vigil.authoring.drafting.drafts import Rejection
from vigil.authoring.drafting.generation import Proposer
from vigil.authoring.drafting.grammar import kinds_of
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import allows, is_target, size_of_thing
from vigil.authoring.language.referring import phrase_for
from vigil.authoring.language.wording import Act
from vigil.errors import first_error
from vigil.protocol.episode import MAX_INSTRUCTION_CHARS, Episode
from vigil.protocol.families import FAMILIES, Family

Complete = Callable[[str], str]
"""Function that sends a text to a model and returns the model's reply. Raises ModelAPIError."""

TRIED = 6
"""Number of the grammar's drafts that are searched for a draft with the objects that the model chose."""
MAX_QUOTED_CHARS = 300
"""Maximum number of characters of a reply that a rejection quotes."""
RULES = ("reply_parses", "draft_fits_schema", "kind_known", "things_known", "can_be_set_up")
"""Rules that an idea may break before it becomes a draft. Rules about drafts: `vigil.authoring.review.validate`."""


_ACTS: tuple[Act, ...] = ("open", "close", "turn_on", "turn_off", "pick")


class Idea(BaseModel):
    """One task as the model proposes it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    kind: str
    things: dict[str, str] = Field(min_length=1)
    """Role -> id of the thing that has this role."""
    instruction: str = Field(min_length=1, max_length=MAX_INSTRUCTION_CHARS)


_TEXT = """You author tasks for an embodied agent that sees one picture at a time in a house.
Family {family} ({name}). {ask}
Known kinds: {kinds}.
Call each thing exactly by its `name` from the inventory (it singles the thing out); mention no other thing, no id, no
coordinate, no hidden state. Vary the sentences; write as a person would speak.

Inventory (JSON lines):
{inventory}

Answer with one JSON object and nothing else, with {count} tasks that differ:
{{"drafts": [{{"kind": "...", "things": {{"target": "<id>"}}, "instruction": "..."}}]}}
"""


def model_proposer(complete: Complete, count: int, author: str) -> Proposer:
    """Return a proposer that asks a model for `count` tasks of a family in a house; `author` is the model's name."""

    def proposals(context: HouseContext, family: Family) -> Iterator[tuple[str, Iterator[Episode | Rejection]]]:
        reply = complete(question(context, family, count))
        for idea in ideas(reply, context, family):
            yield idea.kind, iter((idea if isinstance(idea, Rejection) else draft_of(idea, context, family, author),))

    return proposals


def question(context: HouseContext, family: Family, count: int) -> str:
    """Return the prompt that asks for tasks of a family in a house."""
    return _TEXT.format(
        family=family,
        name=FAMILIES[family].name,
        ask=FAMILIES[family].briefing,
        kinds=", ".join(FAMILIES[family].kinds),
        inventory="\n".join(json.dumps(row, ensure_ascii=False) for row in inventory(context)),
        count=count,
    )


def inventory(context: HouseContext) -> list[dict[str, Any]]:
    """Return rows for the model, sorted by id: each describes one possible target that a phrase can name."""
    items = context.items
    rows: list[dict[str, Any]] = []
    for thing in sorted(context.view.scene.things.values(), key=lambda thing: thing.id):
        if thing.id not in items or not is_target(thing):
            continue
        phrase = phrase_for(items[thing.id], items.values())
        if phrase is not None:
            can = [act for act in _ACTS if allows(thing, act)]
            row = {"id": thing.id, "name": str(phrase), "size": size_of_thing(thing), "can": can}
            row |= {"room": items[thing.id].room, "at": thing.parent}
            rows.append(row)
    return rows


def ideas(reply: str, context: HouseContext, family: Family) -> Iterator[Idea | Rejection]:
    """Yield the ideas in a model's reply. Each invalid idea, or a wholly invalid reply, gives a rejection instead."""
    try:
        found = json.loads(_without_fence(reply))
        rows = found["drafts"]
        if not isinstance(rows, list):
            raise TypeError("`drafts` is not a list")
    except (ValueError, KeyError, TypeError) as error:
        yield context.rejection(family, "", "reply_parses", f"{error}: {reply[:MAX_QUOTED_CHARS]}")
        return
    for row in rows:
        try:
            idea = Idea.model_validate(row)
        except ValidationError as error:
            wrong = first_error(error, "the draft")
            yield context.rejection(family, "", "draft_fits_schema", f"{wrong}: {str(row)[:MAX_QUOTED_CHARS]}")
            continue
        yield _known(idea, context, family)


def draft_of(idea: Idea, context: HouseContext, family: Family, author: str) -> Episode | Rejection:
    """Return a draft with the objects and the words of an idea, or a rejection if no start or setup is found."""
    context.allowed_ids = frozenset(idea.things.values())
    try:
        drafts = list(islice(kinds_of(family)[idea.kind](context), TRIED))
    finally:
        context.allowed_ids = None
    for draft in drafts:
        if all(draft.bindings.get(role) == thing_id for role, thing_id in idea.things.items()):
            provenance = draft.provenance.model_copy(update={"author": author})
            return draft.model_copy(update={"instruction": idea.instruction, "provenance": provenance})
    message = f"no start or setup was found for {dict(sorted(idea.things.items()))}"
    return context.rejection(family, idea.kind, "can_be_set_up", message, idea.instruction)


def _known(idea: Idea, context: HouseContext, family: Family) -> Idea | Rejection:
    if idea.kind not in FAMILIES[family].kinds:
        known = ", ".join(FAMILIES[family].kinds)
        message = f"{idea.kind!r} is not one of {known}"
        return context.rejection(family, idea.kind, "kind_known", message, idea.instruction)
    absent = [thing_id for thing_id in idea.things.values() if thing_id not in context.view.scene.things]
    if absent:
        message = f"{absent[0]!r} is not in the house"
        return context.rejection(family, idea.kind, "things_known", message, idea.instruction)
    return idea


def _without_fence(reply: str) -> str:
    """Return the text inside the code fence if the reply is one code fence; otherwise the reply itself."""
    text = reply.strip()
    if text.startswith("```") and text.endswith("```"):
        text = text[3:-3]
        text = text.removeprefix("json")
    return text
