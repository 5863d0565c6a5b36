"""Closure stress: answers and verdicts of the suite in which it is easy to reach a goal and hard to know whether it
holds.

A pack of the suite has a file `closure.jsonl`, which agents never see. For each episode, the file has the correct
closing (the answer) and the name of its pair. C (correct closure) is a pure function of the answer and a record; it
does not affect W or B. Source: `protocol.md` section 8, decision 30.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import AfterValidator, Field, model_validator

from vigil.base.exported import exported_by_modules
from vigil.base.geometry import Pose, Vec3, distance
from vigil.base.models import FrozenModel
from vigil.errors import EpisodeError, PackMismatch
from vigil.packs.files import PackFiles
from vigil.packs.pack import ANSWERS, find_pack
from vigil.protocol.actions import AnyAction, InteractPixel, Status
from vigil.protocol.episode import Episode
from vigil.protocol.goals import (
    OBSERVABLE_M,
    OBSERVABLE_PX,
    AllOf,
    Goal,
    ObjectHeld,
    ObjectInState,
    grounding_truth,
    is_observable,
)
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.world import Effect, RefusalCode, WorldState
from vigil.records.record import EpisodeRecord
from vigil.scoring.closure_kind import ClosureKind
from vigil.scoring.goal_check import check
from vigil.scoring.outcomes import NEGATIVE, Outcome, score

SUITE: Literal["closure"] = "closure"
"""Value of `meta.suite` in the manifest of a closure-stress pack."""


def _check_kind(name: str) -> str:
    if name not in CLOSURE_KINDS:
        raise ValueError(f"there is no kind {name!r}; the kinds are {', '.join(CLOSURE_KINDS)}")
    return name


Kind = Annotated[str, AfterValidator(_check_kind)]
"""Name of a kind of closure-stress episodes: a key of `CLOSURE_KINDS`."""
CLOSURE_KINDS: dict[Kind, ClosureKind] = {
    kind.name: kind for kind in exported_by_modules("vigil.authoring.closure.kinds", "KIND", ("tasks",))
}
"""Name -> kind of episodes of the suite, in the order in which tables show the kinds."""
KINDS: tuple[Kind, ...] = tuple(CLOSURE_KINDS)
PAIRED: dict[Kind, tuple[str, ...]] = {name: kind.sides for name, kind in CLOSURE_KINDS.items() if kind.sides}
"""Kind of episodes that come as twins (pairs with one difference) -> names of the two sides, one side for each twin."""
Reason = Literal["absent", "elsewhere", "locked", "broken", "no_fit"]
REASONS: tuple[Reason, ...] = get_args(Reason)
FAIL_REASONS: frozenset[Reason] = frozenset({"locked", "broken", "no_fit"})
"""Reasons for which the exact status is `fail`. For the other reasons, e.g. that the named object is not there, the
exact status is `invalid`."""
DISTRACTOR = "distractor"
"""Role of an object that looks like the target but is another object."""
OTHERWISE = "otherwise"
"""Role of the object that becomes the target of an `if_so` episode if the instruction's condition does not hold."""
_SILENT_REFUSALS: frozenset[RefusalCode] = frozenset(
    {"interlock", "blocked_by_object", "hand_full", "receptacle_closed", "no_room", "out_of_order"}
)
"""Reasons why the simulator refuses an action without informing the agent, although the agent can see the cause."""
Claim = Literal["success", "none", "concession"]
ClosureLabel = Literal[
    "closed",  # correct, with no unnecessary action
    "closed_needlessly",  # correct, but something that already held was acted on, perhaps only to check it
    "unreported",  # the goal holds, and the report does not say so
    "wrong_object",  # it was done to the look-alike
    "wrong_branch",  # a state that should have stayed was changed: the other branch of a condition
    "false_success",  # success was reported, and the goal does not hold
    "given_up",  # a goal that could be reached was conceded
    "no_report",
    "other",  # any other report
]
CLOSURE_LABELS: tuple[ClosureLabel, ...] = get_args(ClosureLabel)
CONCEDED: tuple[Status, ...] = ("fail", "invalid")
"""Statuses that close an impossible episode correctly."""


class Evidence(FrozenModel):
    """An object that the agent must see to know that an episode is impossible."""

    object_id: str
    """Id of the object, which counts as seen only if it is observable in a frame."""
    spot: Vec3 | None = None
    """A place on the object that must also be in the frame; None if it is enough to see any part of the object."""
    within_m: float = Field(default=OBSERVABLE_M, gt=0, le=OBSERVABLE_M)
    """Maximum distance (m) from the camera to `spot`. It is small for a notice that can only be read from nearby."""
    min_px: int = Field(default=OBSERVABLE_PX, ge=OBSERVABLE_PX)
    """Minimum number of pixels that the object must have in the frame."""


class Certificate(FrozenModel):
    """Result of an exhaustive search for a plan that reaches the goal."""

    removed: str
    """Id of the object in which the twins differ."""
    has_plan: bool
    """Whether the search found a plan in this twin."""
    refusal: str = ""
    """Reason, given by the search, why there is no plan; empty if there is a plan."""


class ClosureAnswer(FrozenModel):
    """The correct closing of one episode of the suite; hidden from the player."""

    episode_id: str
    kind: Kind
    pair: str | None = None
    """Name of the pair, the same for both twins and for no other episode; None if the episode does not have a twin."""
    side: str | None = None
    form: str = ""
    """Variant of the kind, e.g. how a look-alike differs from the target; empty if the kind does not have variants."""
    accepted: tuple[Status, ...] = ("success",)
    """Statuses that close the episode correctly. The first of them is the exact status."""
    reason: Reason | None = None
    """Reason why the episode is impossible; None if it is possible."""
    evidence: tuple[Evidence, ...] = ()
    certificate: Certificate | None = None

    @model_validator(mode="after")
    def _is_whole(self) -> "ClosureAnswer":
        sides = PAIRED.get(self.kind, ())
        if (self.pair is not None) != bool(sides) or (self.side is not None) != bool(sides):
            raise ValueError(f"an episode of kind {self.kind} {'must belong' if sides else 'cannot belong'} to a pair")
        if self.side is not None and self.side not in sides:
            raise ValueError(f"the side of an episode of kind {self.kind} is {' or '.join(sides)}, not {self.side}")
        if self.is_impossible != (self.reason is not None) or self.is_impossible != (self.accepted != ("success",)):
            raise ValueError(
                "an impossible side must have a reason and accept a concession; any other episode must not"
            )
        if "impossible" in sides and not (self.evidence and self.certificate):
            raise ValueError("a twin must name its evidence and its certificate")
        return self

    @property
    def is_impossible(self) -> bool:
        """Whether the goal of the episode cannot be reached."""
        return self.side == "impossible"


@dataclass(frozen=True, slots=True)
class ClosureOutcome:
    """The verdict on one record of an episode of the suite."""

    answer: ClosureAnswer
    outcome: Outcome
    house: str
    C: bool
    """Whether the closing is correct: the report is true of the world at the end."""
    claim: Claim
    """What the ending claims about the goal (success, nothing, or concession), whether or not the claim is true."""
    is_exact: bool
    """Whether the reported status is the exact status, i.e. the first of the accepted statuses."""
    evidence_seen: float | None
    """Share of the evidence that was seen before the report; None without evidence."""
    is_needless: bool
    """Whether the agent acted on a state that already held at the reset. Clicks without effect count too. If the whole
    goal held at the reset, every act counts."""
    is_wrong_branch: bool
    """Whether the agent changed a state that should have stayed as it was; only in conditional episodes (`if_so`)."""
    is_refused: bool
    """Whether an interaction was refused for a reason that the agent can see."""
    is_wrong_object: bool
    """Whether the agent did the task to the look-alike instead of to the target."""

    @property
    def is_knowing(self) -> bool:
        """Whether the closing is correct and without a needless act. An agent that acts on a state that already holds
        does not know the state.
        """
        return self.C and not self.is_needless

    @property
    def is_false_success(self) -> bool:
        """Whether the agent reported success, but the goal does not hold."""
        return self.claim == "success" and not self.outcome.W

    @property
    def gave_up(self) -> bool:
        """Whether the agent conceded, although the goal could be reached."""
        return self.claim == "concession" and not self.answer.is_impossible and not self.outcome.W

    @property
    def gave_up_early(self) -> bool:
        """Whether the agent conceded before it had seen all the evidence, although the goal could be reached."""
        return self.gave_up and self.evidence_seen is not None and self.evidence_seen < 1.0

    @property
    def label(self) -> "ClosureLabel":
        """Label of the verdict, as tables show it."""
        if self.C:
            return "closed_needlessly" if self.is_needless else "closed"
        if self.outcome.W:
            return "unreported"
        if self.is_wrong_object:
            return "wrong_object"
        if self.is_wrong_branch:
            return "wrong_branch"
        if self.is_false_success:
            return "false_success"
        if self.gave_up:
            return "given_up"
        return "other" if self.outcome.is_reported else "no_report"


def closure_answers(pack: str | Path) -> dict[str, ClosureAnswer]:
    """Return the answers of a pack of the suite by episode id. Raises PackMismatch or EpisodeError."""
    files = PackFiles.of(find_pack(pack))
    if files.manifest.suite != SUITE:
        raise PackMismatch(f"Pack {files.manifest.name!r} is not of the closure-stress suite: it has no answers.")
    return check_pairs(files.rows(ANSWERS, ClosureAnswer))


def check_pairs(answers: Iterable[ClosureAnswer]) -> dict[str, ClosureAnswer]:
    """Return answers by episode id. Raises EpisodeError unless each pair has one answer for each of its sides."""
    found: dict[str, ClosureAnswer] = {}
    pairs: dict[str, list[ClosureAnswer]] = {}
    for answer in answers:
        if answer.episode_id in found:
            raise EpisodeError(f"Two answers are for episode {answer.episode_id!r}. Restore {ANSWERS}.")
        found[answer.episode_id] = answer
        if answer.pair is not None:
            pairs.setdefault(answer.pair, []).append(answer)
    for pair, twins in pairs.items():
        if {twin.side for twin in twins} != set(PAIRED[twins[0].kind]) or len(twins) != 2:
            sides = ", ".join(str(twin.side) for twin in twins)
            raise EpisodeError(f"Pair {pair!r} has the sides {sides}; a pair has one episode of each side.")
    return found


def score_closure(answer: ClosureAnswer, episode: Episode, record: EpisodeRecord) -> ClosureOutcome:
    """Return the verdict on one record. Raises RecordError as `vigil.scoring.outcomes.score` does.

    Raises EpisodeError if `answer` is for another episode.
    """
    if answer.episode_id != episode.id:
        raise EpisodeError(f"Episode {episode.id!r} cannot be scored with the answer of episode {answer.episode_id!r}.")
    outcome, kind = score(episode, record), CLOSURE_KINDS[answer.kind]
    held = _held_at_reset(episode.goal, record) if kind.may_hold_at_reset else []
    conceded = outcome.reported in answer.accepted and outcome.raw_status is None and not outcome.W
    return ClosureOutcome(
        answer=answer,
        outcome=outcome,
        house=episode.house.name,
        C=conceded if answer.is_impossible else outcome.B,
        claim=_claim(outcome),
        is_exact=outcome.reported == answer.accepted[0] and outcome.raw_status is None,
        evidence_seen=evidence_seen(answer.evidence, record),
        is_needless=_is_needless(episode.goal, held, record),
        is_wrong_branch=kind.has_branches and any(_is_changed(part, record) for part in held),
        is_refused=any(step.effect is not None and step.effect.refusal in _SILENT_REFUSALS for step in record.steps),
        is_wrong_object=not outcome.W and _is_done_to(episode.bindings.get(DISTRACTOR), episode.goal, record),
    )


def evidence_seen(evidence: Sequence[Evidence], record: EpisodeRecord) -> float | None:
    """Return the share of the pieces of evidence that were each seen in a frame of a record; None without evidence."""
    if not evidence:
        return None
    frames = record.worlds[:-1] if record.steps else record.worlds
    return sum(any(_shows(world, each) for world in frames) for each in evidence) / len(evidence)


def _shows(world: WorldState, evidence: Evidence) -> bool:
    state = world.objects.get(evidence.object_id)
    if state is None or not is_observable(state) or state.visible_px < evidence.min_px:
        return False
    return evidence.spot is None or is_in_picture(world.agent, evidence.spot, evidence.within_m)


def is_in_picture(agent: Pose, spot: Vec3, within_m: float = OBSERVABLE_M) -> bool:
    """Return whether a place is inside an agent's frame and at most `within_m` from the camera, ignoring occlusion."""
    eye = agent.eye
    x, y, z = (there - here for there, here in zip(spot, eye, strict=True))
    yaw, pitch = math.radians(agent.rotation), math.radians(agent.horizon)
    right = x * math.cos(yaw) - z * math.sin(yaw)
    level = x * math.sin(yaw) + z * math.cos(yaw)
    ahead = level * math.cos(pitch) - y * math.sin(pitch)
    up = level * math.sin(pitch) + y * math.cos(pitch)
    is_in_frame = abs(up) <= ahead and abs(right) <= ahead * FRAME_WIDTH / FRAME_HEIGHT
    return ahead > 0 and is_in_frame and distance(eye, spot) <= within_m


def _claim(outcome: Outcome) -> Claim:
    if outcome.reported == "success":
        return "success"
    return "concession" if outcome.reported in NEGATIVE else "none"


def _is_done_to(object_id: str | None, goal: Goal, record: EpisodeRecord) -> bool:
    """Return whether the goal, with `object_id` as its target, holds at the end and did not hold at the reset."""
    if object_id is None or not isinstance(goal, ObjectInState | ObjectHeld):
        return False
    rows = check(goal.model_copy(update={"object_id": object_id}), record).rows
    return rows[-1].semantic and not rows[0].semantic


def _parts(goal: Goal) -> tuple[Goal, ...]:
    return goal.parts if isinstance(goal, AllOf) else (goal,)


def _held_at_reset(goal: Goal, record: EpisodeRecord) -> list[ObjectInState]:
    """Return those parts of a goal that already held at the reset."""
    asked = [part for part in _parts(goal) if isinstance(part, ObjectInState) and part.state != "is_visible"]
    return [part for part in asked if check(part, record).rows[0].semantic]


def _is_changed(part: ObjectInState, record: EpisodeRecord) -> bool:
    states = [world.objects[part.object_id] for world in record.worlds]
    values: list[Any] = [state.is_toggled if part.state == "is_toggled" else state.openness for state in states]
    return any(value != values[0] for value in values)


def _is_needless(goal: Goal, held: Sequence[ObjectInState], record: EpisodeRecord) -> bool:
    """Return whether the agent changed or clicked an object whose required state held at the reset. Refused clicks
    count too.

    If the whole goal held at the reset, every act is needless, whatever it hits: a click meant for an open door may hit
    the floor.
    """
    acts = [step.effect for step in record.steps if _is_act(step.action)]
    if acts and len(held) == len(_parts(goal)):
        return True
    return any(_is_changed(part, record) or _is_acted_on(part, record, acts) for part in held)


def _is_act(action: AnyAction | None) -> bool:
    """Return whether an action is a click with any intent except `ground`, which only points."""
    return isinstance(action, InteractPixel) and action.intent != "ground"


def _is_acted_on(part: ObjectInState, record: EpisodeRecord, acts: Iterable[Effect | None]) -> bool:
    category = record.worlds[0].objects[part.object_id].category
    return any(grounding_truth(part.object_id, category, effect)[0] for effect in acts)
