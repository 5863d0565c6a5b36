"""Comparison of two back ends: each recorded solution of a pack is played on both, and compared action by action."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from vigil.authoring.review.validate import Validator
from vigil.base.geometry import Box, distance, turn_between
from vigil.packs.pack import Pack
from vigil.protocol.episode import Episode
from vigil.protocol.world import Effect, WorldState
from vigil.records.record import EpisodeRecord
from vigil.scoring.outcomes import score
from vigil.sim.privileged import PrivilegedSimulator

SAME_M, SAME_DEG, SAME_OPENNESS = 1e-3, 0.01, 1e-3
"""Distances (m), angles (deg) and openness count as equal if they differ by at most these values."""
SAME_CLICK_M = 0.01
"""Distances (m) from the agent to clicked points count as equal if they differ by at most this."""
KINDS = {
    "pose": "where the agent is and looks",
    "place": "where a thing is, and how it is turned",
    "state": "how far a thing is open, and whether it is on",
    "hand": "what is held",
    "support": "what a thing rests on, and what it is inside of",
    "box": "a thing's box, and the distance to it",
    "pixels": "how many pixels of a thing, and of its state, are seen",
    "nearest": "the distance to a thing's nearest visible point",
    "visible": "the simulator's own word for visible",
    "hit": "what a click hits, and where",
    "near": "what lies within 3 pixels of a click",
    "moved": "how far an action moved or turned the agent",
    "refusal": "whether an action is refused, why, and by what",
    "changed": "which things an action changed",
    "end": "how the episode ends",
    "verdict": "W, W_strict, B and the label",
    "verdict by sight": "the verdict; it is equal if both back ends are taken to see the same",
}
"""Kind of difference -> what differs."""
ComparedFacts = tuple[tuple[str, float, tuple[str, ...]], ...]
"""Kind of difference, greatest difference of numbers that count as equal, and names of the compared facts."""
EFFECT_FACTS: ComparedFacts = (
    ("moved", SAME_M, ("moved_m", "turned_deg", "pitched_deg")),
    ("refusal", 0.0, ("refusal", "too_far", "path_blocked", "blocked_by", "capped")),
    ("hit", 0.0, ("hit",)),
    ("near", 0.0, ("near",)),
    ("changed", 0.0, ("changed",)),
    ("hit", SAME_CLICK_M, ("click_m",)),
)
OBJECT_FACTS: ComparedFacts = (
    ("state", SAME_OPENNESS, ("openness", "is_toggled")),
    ("hand", 0.0, ("is_held",)),
    ("support", 0.0, ("parent", "support_chain", "inside", "not_on", "over", "over_inside")),
    ("box", SAME_M, ("box",)),
    ("pixels", 0.0, ("visible_px", "open_px", "toggle_px")),
    ("nearest", SAME_M, ("nearest_visible_m",)),
    ("visible", 0.0, ("visible",)),
)
SEEN = ("visible", "visible_px", "open_px", "toggle_px", "nearest_visible_m")
"""Names of the facts in an object's state that say how the object is seen."""


@dataclass(frozen=True, slots=True)
class BackendDifference:
    """A fact in which two back ends differ."""

    episode_id: str
    step: int
    """Number of the step; 0 is the start."""
    kind: str
    what: str
    a: Any
    b: Any

    def __str__(self) -> str:
        return f"{self.episode_id} step {self.step}: {self.what}: {self.a} / {self.b}"


@dataclass(frozen=True, slots=True)
class BackendComparison:
    """Result of a comparison of two back ends."""

    a: str
    """Name of the first back end."""
    b: str
    """Name of the second back end."""
    episodes: int
    steps: int
    differences: tuple[BackendDifference, ...]

    def of_kind(self, kind: str) -> list[BackendDifference]:
        """Return the differences of this kind."""
        return [each for each in self.differences if each.kind == kind]


def compare_backends(
    pack: Pack,
    episodes: Sequence[Episode],
    a: PrivilegedSimulator,
    b: PrivilegedSimulator,
    on_progress: Callable[[int, int], None] = lambda done, of: None,
) -> BackendComparison:
    """Play the recorded solutions of episodes on two back ends, and return the differences.

    Episodes without a recorded solution are left out.
    """
    solved = [episode for episode in episodes if episode.id in pack.solutions]
    found: list[BackendDifference] = []
    players, steps = (Validator(a), Validator(b)), 0
    for number, episode in enumerate(sorted(solved, key=lambda each: (each.house.name, each.id)), start=1):
        house, actions = pack.house_of(episode), pack.solutions[episode.id].actions
        records = [player.play(episode, house, actions) for player in players]
        steps += len(actions)
        found += differences(episode, *records)
        on_progress(number, len(solved))
    return BackendComparison(a.name, b.name, len(solved), steps, tuple(found))


def differences(episode: Episode, a: EpisodeRecord, b: EpisodeRecord) -> Iterator[BackendDifference]:
    """Yield the differences between two records of the same actions."""
    for step, (one, other) in enumerate(zip(a.worlds, b.worlds, strict=False)):
        effects = (a.steps[step - 1].effect, b.steps[step - 1].effect) if step else (None, None)
        facts = [*_effects(*effects), *_worlds(one, other)]
        yield from (BackendDifference(episode.id, step, *fact) for fact in facts)
    last = min(len(a.steps), len(b.steps))
    verdicts = _verdict(episode, a), _verdict(episode, b)
    by_sight = _verdict(episode, _with_visibility_of(a, b)) == verdicts[0]
    ends = [(each.end, len(each.steps), each.error.message if each.error else "") for each in (a, b)]
    facts = ("end", "end", ends[0], ends[1]), ("verdict by sight" if by_sight else "verdict", "verdict", *verdicts)
    yield from (BackendDifference(episode.id, last, *fact) for fact in facts if fact[2] != fact[3])


UnequalFact = tuple[str, str, Any, Any]


def _verdict(episode: Episode, record: EpisodeRecord) -> tuple[Any, ...] | None:
    if record.end == "error":
        return None
    outcome = score(episode, record)
    return outcome.W, outcome.W_strict, outcome.B, outcome.label


def _with_visibility_of(a: EpisodeRecord, b: EpisodeRecord) -> EpisodeRecord:
    """Return record b, but with the facts about how objects are seen (`SEEN`) from record a."""
    if a.initial is None or b.initial is None:
        return b
    initial, *worlds = map(_world_with_visibility_of, a.worlds, b.worlds)
    seen = [step.model_copy(update={"world": world}) for step, world in zip(b.steps, worlds, strict=False)]
    return b.model_copy(update={"initial": initial, "steps": (*seen, *b.steps[len(seen) :])})


def _world_with_visibility_of(a: WorldState, b: WorldState) -> WorldState:
    facts = {name: {fact: getattr(a.objects[name], fact) for fact in SEEN} for name in b.objects}
    return b.model_copy(update={"objects": {name: b.objects[name].model_copy(update=facts[name]) for name in facts}})


def _effects(a: Effect | None, b: Effect | None) -> Iterator[UnequalFact]:
    return iter(()) if a is None or b is None else _unequal(a, b, EFFECT_FACTS)


def _worlds(a: WorldState, b: WorldState) -> Iterator[UnequalFact]:
    turned = turn_between(a.agent.rotation, b.agent.rotation), turn_between(a.agent.horizon, b.agent.horizon)
    if distance(a.agent.position, b.agent.position) > SAME_M or max(map(abs, turned)) > SAME_DEG:
        yield "pose", "agent", a.agent, b.agent
    yield from _unequal(a, b, (("hand", 0.0, ("held",)),))
    for name, state in a.objects.items():
        other = b.objects[name]
        turn = turn_between(state.box.yaw, other.box.yaw)
        if distance(state.position, other.position) > SAME_M or abs(turn) > SAME_DEG:
            yield "place", f"{name} position", state.position, other.position
        yield from ((kind, f"{name} {fact}", *values) for kind, fact, *values in _unequal(state, other, OBJECT_FACTS))


def _unequal(a: Any, b: Any, facts: ComparedFacts) -> Iterator[UnequalFact]:
    for kind, within, names in facts:
        for name in names:
            one, other = getattr(a, name), getattr(b, name)
            if not _is_same(one, other, within):
                yield kind, name, one, other


def _is_same(a: Any, b: Any, within: float) -> bool:
    if isinstance(a, Box):
        sizes = zip(a.size, b.size, strict=True)
        return distance(a.center, b.center) <= within and all(_is_same(*size, within) for size in sizes)
    return a == b or (isinstance(a, float) and isinstance(b, float) and abs(a - b) <= within)
