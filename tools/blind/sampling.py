"""What the seed of a blind round draws: things and states, starts of episodes, and moments before and after a pick."""

import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, product
from typing import Any

import numpy as np

from tools.blind.drawing import Portrait, StartView
from tools.blind.forms import RoundKind
from vigil.assets.catalog import CATALOG
from vigil.packs.files import HOUSES
from vigil.packs.names import newest_version, stem_of
from vigil.packs.pack import Pack, packaged_names
from vigil.protocol.actions import InteractPixel, PhysicalAction, Report
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.protocol.observation import Quality
from vigil.sim.pictures.object_renders import stage_subject
from vigil.sim.pictures.staged_scenes import SceneSubject, states_of

ROUNDS = 101
"""Of all categories that are drawn at most, and by how much the variants of one seed are away from the next seed's."""
FAR_M, FAR_SPAN_PX = 3.0, 30
"""Distance (m) of things in rounds `far`, and the least size that they must have there."""
QUALITIES: tuple[Quality, ...] = ("default", "fast")


@dataclass(frozen=True, slots=True)
class EpisodeCandidate:
    """An episode of a pack."""

    pack: Pack
    episode: Episode

    @property
    def start(self) -> StartView:
        """The job that draws its start."""
        folder, episode = self.pack.folder, self.episode
        house = folder / HOUSES / f"{episode.house.name}.json"
        return StartView(str(house), episode.start.model_dump(mode="json"), episode.setup.model_dump(mode="json"))

    @property
    def house(self) -> House:
        """Its house."""
        return self.pack.house_of(self.episode)

    @property
    def truth(self) -> dict[str, Any]:
        """Return the facts about the episode in a round's key."""
        return {"pack": self.pack.name, "episode": self.episode.id}


@dataclass(frozen=True, slots=True)
class PickMoment:
    """A moment of an episode's solution: a thing is about to be picked, or has just been."""

    candidate: EpisodeCandidate
    actions: tuple[PhysicalAction, ...]
    """Actions up to and including the pick."""

    @property
    def category(self) -> str:
        """Category of the episode's target."""
        return self.candidate.episode.bindings.get("target", "").partition("|")[0]


def portraits(kind: RoundKind, seed: int, count: int) -> list[Portrait]:
    """Return the subjects of a round `near`, `far` or `state`. Raises ValueError when there are too few."""
    distance_m = FAR_M if kind == "far" else None

    def suits(subject: SceneSubject) -> bool:
        if kind == "far":
            return _is_large_enough(subject, seed)
        return kind == "near" or subject.state is not None

    subjects = draw_subjects(count, seed, suits)
    return [Portrait(each.category, each.variant, each.state, seed, distance_m) for each in subjects]


def draw_subjects(count: int, seed: int, suits: Callable[[SceneSubject], bool] = lambda _: True) -> list[SceneSubject]:
    """Return `count` subjects in random order, every category equally often, each time another variant and state.

    Those that do not suit are passed over, so that their categories are seen less often. Raises ValueError when too few
    suit in `ROUNDS` rounds of all categories.
    """
    rng = np.random.default_rng(seed)
    subjects = list(islice(filter(suits, _subject_rounds(rng, seed)), count))
    if len(subjects) < count:
        raise ValueError(f"Only {len(subjects)} of {count} subjects that suit are found; ask for fewer.")
    return [subjects[number] for number in rng.permutation(len(subjects))]


def _subject_rounds(rng: np.random.Generator, seed: int) -> Iterator[SceneSubject]:
    """Yield subjects in rounds, each of every category once."""
    names = sorted(CATALOG)
    for turn in range(ROUNDS):
        for name in map(str, rng.permutation(names)):
            variant = ROUNDS * seed + turn
            states = states_of(SceneSubject(name, variant).asset)
            first = int(np.random.default_rng([seed, len(name)]).integers(len(states)))
            yield SceneSubject(name, variant, states[(first + turn) % len(states)])


def _is_large_enough(subject: SceneSubject, seed: int) -> bool:
    try:
        return stage_subject(subject, seed, FAR_M)[1].span_px >= FAR_SPAN_PX
    except ValueError:  # the room is too small for it to be seen whole
        return False


def candidates(packs: Sequence[str]) -> list[EpisodeCandidate]:
    """Return the episodes of some packs, each id once, sorted by it; without names of the newest packaged ones.

    Raises PackMismatch.
    """
    names = packs or _newest_packaged()
    found = {episode.id: EpisodeCandidate(pack, episode) for pack in map(Pack.load, names) for episode in pack.episodes}
    return [found[name] for name in sorted(found)]


def _newest_packaged() -> list[str]:
    names = packaged_names()
    return [name for name in names if stem_of(name) is None or newest_version(stem_of(name) or "", names) == name]


def in_random_order(found: Sequence[EpisodeCandidate], kind: RoundKind, seed: int) -> Iterator[EpisodeCandidate]:
    """Yield episodes in an order drawn by a seed, another one for each kind of round."""
    for number in np.random.default_rng([seed, zlib.crc32(kind.encode())]).permutation(len(found)):
        yield found[number]


def picks(found: Sequence[EpisodeCandidate], seed: int) -> list[PickMoment]:
    """Return the first pick of each solution that has one, in random order: every category once, then again."""
    turns: dict[str, int] = {}
    ordered: list[tuple[int, PickMoment]] = []
    for candidate in in_random_order(found, "held", seed):
        actions = [
            each for each in candidate.pack.solutions[candidate.episode.id].actions if not isinstance(each, Report)
        ]
        at = next((number for number, action in enumerate(actions) if _is_pick(action)), None)
        if at is not None:
            pick = PickMoment(candidate, tuple(actions[: at + 1]))
            turns[pick.category] = turns.get(pick.category, 0) + 1
            ordered.append((turns[pick.category], pick))
    return [pick for _, pick in sorted(ordered, key=lambda each: each[0])]


def _is_pick(action: PhysicalAction) -> bool:
    return isinstance(action, InteractPixel) and action.intent == "pick"


def held_cases(count: int, seed: int) -> list[tuple[bool, Quality]]:
    """Return in random order whether something is held, and in which quality that is drawn: each equally often."""
    cases = list(product((True, False), QUALITIES))
    shared = [cases[number % len(cases)] for number in range(count)]
    return [shared[number] for number in np.random.default_rng([seed, 1]).permutation(count)]


def sides(count: int, seed: int) -> list[bool]:
    """Return in random order, for half of the pairs each, whether the older picture is on the left."""
    shared = [number % 2 == 0 for number in range(count)]
    return [shared[number] for number in np.random.default_rng([seed, 2]).permutation(count)]
