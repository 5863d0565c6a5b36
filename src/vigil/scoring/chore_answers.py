"""Answers of the suite `chores`: for each chore its kind, and the claim that closes it correctly.

How an episode of the suite is stored:

- `Episode` (family SI, goal `chores`) holds all that W depends on: `goal.chores[k - 1]` is chore k, and line k of the
  instruction (`vigil.base.numbered_list`) says it in words. Records, replay and `vigil verify` need nothing else.
- `chores.jsonl`, next to `episodes.jsonl`, holds one `ListAnswer` for each episode: the facts on which W does not
  depend. A chore that cannot be met has a `reason` there; its goal is in the episode like any other, and never holds.
- The manifest has `meta.suite: "chores"`.

Source: `protocol.md` section 9.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Literal, get_args

from pydantic import Field, model_validator

from vigil.base.models import FrozenModel
from vigil.errors import EpisodeError, PackMismatch
from vigil.packs.files import PackFiles
from vigil.packs.pack import CHORE_ANSWERS, CHORES_SUITE, find_pack
from vigil.protocol.actions import Status
from vigil.protocol.episode import Episode
from vigil.protocol.goals import STATE_LABELS, Chore, Chores
from vigil.scoring.closure import CONCEDED, Certificate, Evidence, Reason

ChoreKind = Literal[
    "plain",  # an act whose first try works
    "hidden",  # its object lies in a closed container, which the sentence does not name
    "question",  # find something and say its state
    "already",  # it holds at the reset
    "impossible",  # it cannot be met, for a reason that is in view
    "refused",  # the first try is refused, without a message
    "conditional",  # it depends on a state at the reset which of two acts is asked for, or whether any is
    "look_alike",  # another object can be taken for the one that is meant
    "order",  # it and another chore undo one another unless they are done in one order
    "by_the_way",  # it is done when another chore is
]
CHORE_KINDS: tuple[ChoreKind, ...] = get_args(ChoreKind)


class ChoreAnswer(FrozenModel):
    """The hidden facts about one chore, and the claims that close it correctly."""

    kind: ChoreKind
    form: str = ""
    """Variant of the chore's kind; empty if the kind has no variants."""
    accepted: tuple[Status, ...] = ("success",)
    """Claims that close the chore correctly, the most exact first. A question accepts only the label of the state at
    the reset."""
    reason: Reason | None = None
    """Reason why the chore cannot be met; None if it can be met."""
    with_chores: tuple[int, ...] = ()
    """Numbers of the chores that interact with this chore: doing one also undoes the other (`order`), or also does the
    other (`by_the_way`)."""
    distractor: str | None = None
    """Id of an object that an agent may mistake for the object that the chore means."""
    evidence: tuple[Evidence, ...] = ()
    """What an agent must see to know that the chore cannot be met, or that it already holds."""
    certificate: Certificate | None = None

    @model_validator(mode="after")
    def _is_whole(self) -> "ChoreAnswer":
        is_impossible = self.kind == "impossible"
        if is_impossible != (self.reason is not None) or is_impossible != (set(self.accepted) == set(CONCEDED)):
            raise ValueError(
                "a chore must have a reason, and accept the concessions, if its kind is `impossible`; otherwise not"
            )
        if (self.kind in ("order", "by_the_way")) != bool(self.with_chores):
            raise ValueError(
                "a chore must list related chores in `with_chores` if its kind is `order` or `by_the_way`; otherwise "
                "not"
            )
        if (self.kind == "look_alike") != (self.distractor is not None):
            raise ValueError("a chore must have a distractor if its kind is `look_alike`; otherwise not")
        return self

    @property
    def is_possible(self) -> bool:
        """Whether the chore can be met."""
        return self.reason is None


def list_kind(chores: int) -> str:
    """Return the name of the kind of lists with this number of chores; packs have about equally many of each kind."""
    return f"chores_{chores:02d}"


class ListAnswer(FrozenModel):
    """The answer of one list: how each of its chores is closed correctly. It is hidden from the player."""

    episode_id: str
    kind: str
    """Name of the list's kind, which `list_kind` makes from the number of chores."""
    chores: tuple[ChoreAnswer, ...] = Field(min_length=1)
    """Answers in the order of the list; the first answer is for chore 1."""
    rooms: int = Field(default=1, ge=1)
    """Number of rooms of the home."""
    solver_steps: int | None = Field(default=None, ge=1)
    """Number of actions of the recorded solution."""

    @model_validator(mode="after")
    def _is_whole(self) -> "ListAnswer":
        expected = list_kind(len(self.chores))
        if self.kind != expected:
            raise ValueError(f"kind is {self.kind!r}, but must be {expected!r} for a list of {len(self.chores)} chores")
        for number, chore in enumerate(self.chores, start=1):
            if any(not 1 <= other <= len(self.chores) or other == number for other in chore.with_chores):
                raise ValueError(
                    f"chore {number} names chores {chore.with_chores}, but the list has {len(self.chores)} chores"
                )
        if not any(chore.is_possible for chore in self.chores):
            raise ValueError("all chores of the list are impossible; at least one must be possible")
        return self


def list_answers(pack: str | Path) -> dict[str, ListAnswer]:
    """Return {episode id: answer} of a pack of the suite. Raises PackMismatch or EpisodeError."""
    files = PackFiles.of(find_pack(pack))
    if files.manifest.suite != CHORES_SUITE:
        raise PackMismatch(
            f"Pack {files.manifest.name!r} is not a pack of the suite {CHORES_SUITE!r}, so it does not have answers "
            "for chores."
        )
    return answers_by_id(files.rows(CHORE_ANSWERS, ListAnswer))


def answers_by_id(answers: Iterable[ListAnswer]) -> dict[str, ListAnswer]:
    """Return {episode id: answer}. Raises EpisodeError if two answers are for the same episode."""
    found: dict[str, ListAnswer] = {}
    for answer in answers:
        if answer.episode_id in found:
            raise EpisodeError(f"Two answers are for episode {answer.episode_id!r}. Restore {CHORE_ANSWERS}.")
        found[answer.episode_id] = answer
    return found


def answer_of(episode: Episode, answers: Mapping[str, ListAnswer]) -> ListAnswer:
    """Return the answer of an episode. Raises EpisodeError if it is missing, or does not fit the episode's goal."""
    answer = answers.get(episode.id)
    if answer is None:
        raise EpisodeError(f"Episode {episode.id!r} has no answer. Restore {CHORE_ANSWERS}.")
    check_answer(episode, answer)
    return answer


def check_answer(episode: Episode, answer: ListAnswer) -> None:
    """Raise EpisodeError unless an answer is for this episode and fits its goal."""
    if answer.episode_id != episode.id:
        raise EpisodeError(f"The answer is for episode {answer.episode_id!r}, not for {episode.id!r}.")
    if not isinstance(episode.goal, Chores):
        raise EpisodeError(f"Episode {episode.id!r}: its goal is {episode.goal.kind}, not a list of chores.")
    if len(answer.chores) != len(episode.goal.chores):
        raise EpisodeError(
            f"Episode {episode.id!r} has {len(episode.goal.chores)} chores, its answer {len(answer.chores)}. "
            f"Restore {CHORE_ANSWERS}."
        )
    for number, (chore, found) in enumerate(zip(episode.goal.chores, answer.chores, strict=True), start=1):
        fault = _misfit(chore, found)
        if fault:
            raise EpisodeError(f"Episode {episode.id!r}, chore {number}: {fault}. Restore {CHORE_ANSWERS}.")


def _misfit(chore: Chore, answer: ChoreAnswer) -> str:
    """Return how an answer differs from its chore; empty if it fits."""
    facts = {"question": chore.question is not None, "conditional": chore.condition is not None}
    for kind, is_so in facts.items():
        if is_so != (answer.kind == kind):
            return f"the answer is of kind {answer.kind}, but the chore is {'' if is_so else 'not '}of kind {kind}"
    labels = ("success",) if chore.question is None else STATE_LABELS[chore.question.state]
    if answer.is_possible and (len(answer.accepted) != 1 or answer.accepted[0] not in labels):
        return f"the accepted claims are {', '.join(answer.accepted)}, expected {' or '.join(labels)}"
    return ""
