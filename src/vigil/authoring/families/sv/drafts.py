"""Drafts of State Verification (SV), and its sentence forms (see `vigil.authoring.language.sentences`)."""

from pathlib import Path
from typing import Literal

import numpy as np

from vigil.authoring.drafting.house_context import MARGIN_PX, HouseContext, TaskSpec, VisibilityTest
from vigil.authoring.drafting.proposals import (
    LEVEL_DEG,
    SV_TOGGLES,
    UNCLEAR_WHEN_OPEN,
    Drafts,
    is_target,
    with_laptop_open,
)
from vigil.authoring.language.sentences import Forms, Sentences, read_sentences
from vigil.authoring.language.wording import OpeningPhrase, opening_phrase, say
from vigil.authoring.review.rules import STATE_START_PX
from vigil.base.geometry import EYE_HEIGHT_M
from vigil.protocol.families import FAMILIES
from vigil.protocol.family import DEFAULT_HORIZON_DEG
from vigil.protocol.goals import ReportStatus, StateLabel, is_state_observable
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.things import Thing

QueriedState = Literal["is_toggled", "is_open"]
STATE_PX, HARD_STATE_PX = 350, STATE_START_PX
"""Minimum visible pixels of the parts that show the state, at a start that is clear to a person and at a hard start."""
ABOVE_EYES_M = 0.3
"""The camera is level at the start unless the target is more than this far (m) below the eyes."""
LABELS: dict[StateLabel, tuple[QueriedState, ObjectSetup]] = {
    "on": ("is_toggled", ObjectSetup(is_toggled=True)),
    "off": ("is_toggled", ObjectSetup(is_toggled=False)),
    "open": ("is_open", ObjectSetup(openness=1.0)),
    "closed": ("is_open", ObjectSetup(openness=0.0)),
}
"""Label -> the queried state, and the change to the object after which the label is correct."""
_FORMS = read_sentences(Path(__file__).with_name("sentences.toml"))


def _either(one: str, is_one: str, other: str) -> Sentences:
    """Return the questions about two states, with the words for these states."""
    return _FORMS["either"].with_halves(
        lambda half: (form.replace("<is one>", is_one).replace("<one>", one).replace("<other>", other) for form in half)
    )


QUESTIONS: dict[QueriedState, Sentences] = {
    "is_toggled": _either("on", "switched on", "off"),
    "is_open": _either("open", "open", "closed"),
}
"""Kind of state -> the questions about this state."""
BURNING_OR_NOT = _FORMS["burning"]
"""Questions that ask whether a candle is burning."""


def verifying(context: HouseContext, label: StateLabel) -> Drafts:
    """Yield drafts whose target is in the state `label` at the start."""
    state, change = LABELS[label]
    for thing in context.things(lambda thing: is_target(thing) and _has_state(thing, state)):
        setup = Setup(objects={thing.id: with_laptop_open(thing, change) if state == "is_toggled" else change})
        if not context.can_begin(setup):
            continue
        start = context.start_seeing(
            thing,
            FAMILIES["SV"].start_distance_m,
            LEVEL_DEG if thing.position.y > EYE_HEIGHT_M - ABOVE_EYES_M else DEFAULT_HORIZON_DEG / 2,
            _shows_state(state, HARD_STATE_PX if context.prefers_hard_starts else STATE_PX),
        )
        phrase = context.phrase(thing.id)
        context.begin(Setup())
        if start is not None:
            yield context.draft(
                "SV",
                TaskSpec(
                    start=start,
                    setup=setup,
                    instruction=state_question(state, thing.category, str(phrase), context.forms, context.rng),
                    goal=ReportStatus(object_id=thing.id, state=state),
                    bindings={"target": thing.id},
                    template=label,
                ),
            )


def _shows_state(state: QueriedState, min_px: int) -> VisibilityTest:
    """Return a test that passes if `min_px` pixels, plus a margin, of the parts that show a state are in the frame."""
    needed = min_px + 2 * MARGIN_PX
    return VisibilityTest(
        needed, lambda seen: seen.state_px(state) >= needed and seen.visible and is_state_observable(seen, state)
    )


def _has_state(thing: Thing, state: QueriedState) -> bool:
    if state == "is_toggled":
        return thing.is_toggleable and thing.category in SV_TOGGLES
    return thing.is_openable and thing.category not in UNCLEAR_WHEN_OPEN


def state_question(asked: QueriedState, category: str, phrase: str, forms: Forms, rng: np.random.Generator) -> str:
    """Return a random question about a thing's state. The question names both possible answers."""
    if category == "Candle":
        return say(BURNING_OR_NOT.of(forms), rng, target=phrase)
    parts = opening_phrase(category, phrase) if asked == "is_open" else OpeningPhrase(phrase, "it")
    return say(QUESTIONS[asked].of(forms), rng, **parts.slots())
