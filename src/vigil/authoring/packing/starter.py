"""The starter pack: 80 episodes in houses of the project's own, proposed, validated, solved and frozen by one function.

Everything follows from the literal tables below and the versions of the generator and the assets: the same code gives
the same bytes. The packaged starter 1.1 is frozen: its houses are of generator version 2.
"""

import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from vigil.actions import Action
from vigil.authoring.drafting.grammar import GRAMMAR, Proposals
from vigil.authoring.drafting.house_context import Workshop
from vigil.authoring.packing.dataset_card import write_card
from vigil.authoring.review.validate import Validator
from vigil.authoring.solving.oracle import PrivilegedSimulator
from vigil.episode import Episode, Family, Solution
from vigil.errors import EpisodeError, SettingError
from vigil.freezing import freeze
from vigil.house import House
from vigil.housegen.base.spec import spec_for
from vigil.housegen.document import generators_of
from vigil.housegen.generate import generate
from vigil.pack import Pack

NAME = "starter"
VERSION = "1.2"
SEED = 2026
DRAFTS_PER_HOUSE = 6
PER_HOUSE_AND_FAMILY = 2
CATEGORY_USES = 3
FIRST_SEED, SEED_TRIES = 101, 5

HOUSES = (
    *("kitchen-living", "kitchen-living", "kitchen-living", "kitchen-living"),
    *("bedroom-living", "bedroom-living", "bedroom-living", "bedroom-living"),
    *("bedroom-bathroom", "bedroom-bathroom", "2-room", "2-room"),
    *("kitchen", "kitchen", "kitchen", "kitchen", "living-room", "living-room", "living-room"),
    *("bedroom", "bedroom", "bedroom", "bathroom", "bathroom"),
)
"""Specs of the houses; the one at index i has the seed `FIRST_SEED + i` (or that plus hundreds)."""


@dataclass(frozen=True, slots=True)
class Slot:
    """A kind of episode that the pack has so many of."""

    family: Family
    kind: str
    count: int
    instead: str | None = None
    """The kind to propose when no house yields the kind itself."""

    @property
    def proposals(self) -> list[Proposals]:
        """What is proposed: other categories than before, then any, then another kind."""
        kinds = GRAMMAR[self.family]
        return [kinds[self.kind], kinds[self.kind], *([kinds[self.instead]] if self.instead else [])]


SLOTS = (
    Slot("CR", "leaf", 2, "obstacle"),
    Slot("CR", "obstacle", 2),
    Slot("CR", "swing", 2),
    Slot("CR", "interlock", 2),
    Slot("CR", "hand", 2),
    Slot("SM", "reveal_pick", 3),
    Slot("SM", "put_into", 3),
    Slot("SM", "open_pick_place", 2),
    Slot("SM", "rearrange", 2),
    Slot("SV", "on", 3),
    Slot("SV", "off", 3),
    Slot("SV", "open", 2),
    Slot("SV", "closed", 2),
    Slot("VS", "walk", 7),
    Slot("VS", "turn", 3),
    Slot("SI", "open", 2),
    Slot("SI", "close", 2),
    Slot("SI", "turn_on", 2),
    Slot("SI", "turn_off", 2),
    Slot("SI", "pick", 2),
    Slot("AI", "open", 2),
    Slot("AI", "close", 2),
    Slot("AI", "turn_on", 2),
    Slot("AI", "turn_off", 2),
    Slot("AI", "pick", 2),
    Slot("PG", "large", 3),
    Slot("PG", "medium", 4),
    Slot("PG", "small", 3),
    Slot("DA", "approach", 10),
)
"""The scarcest kinds first, so that they find the houses that they need."""


@dataclass(slots=True)
class Chosen:
    """What has been chosen so far."""

    episodes: list[Episode] = field(default_factory=list)
    solutions: list[Solution] = field(default_factory=list)
    uses: Counter[str] = field(default_factory=Counter)
    """House name -> episodes."""
    family_uses: Counter[tuple[str, str]] = field(default_factory=Counter)
    categories: Counter[str] = field(default_factory=Counter)
    family_categories: Counter[tuple[str, str]] = field(default_factory=Counter)

    def takes(self, family: str, category: str) -> bool:
        """Whether another episode about a category is welcome."""
        return not self.family_categories[family, category] and self.categories[category] < CATEGORY_USES

    def add(self, episode: Episode, actions: tuple[Action, ...], category: str) -> None:
        """Takes over a valid episode, under its final id."""
        provenance = episode.provenance.model_copy(update={"validated": True, "solution_steps": len(actions)})
        episode_id = self._id(episode, category)
        self.episodes.append(episode.model_copy(update={"id": episode_id, "provenance": provenance}))
        self.solutions.append(Solution(episode_id=episode_id, actions=actions))
        self.uses[episode.house.name] += 1
        self.family_uses[episode.family, episode.house.name] += 1
        self.categories[category] += 1
        self.family_categories[episode.family, category] += 1

    def _id(self, episode: Episode, category: str) -> str:
        taken = {each.id for each in self.episodes}
        plain = f"procthor_{category.lower()}_seed{episode.provenance.seed or 0:03d}"
        family = f"{plain}_{episode.family.lower()}"
        more = (f"{family}{number}" for number in range(2, len(taken) + 3))
        return next(each for each in (plain, family, *more) if each not in taken)


def build_starter(out: Path, simulator: PrivilegedSimulator, report: Callable[[str], None] = lambda line: None) -> Pack:
    """Writes the starter pack into `out`, new or empty, and returns it; `report` is told of each episode.

    Raises EpisodeError when the houses do not yield a kind of episode.
    """
    houses = starter_houses()
    chosen = Chosen()
    for slot in SLOTS:
        for number in range(slot.count):
            episode = _fill(slot, number, houses, chosen, simulator)
            report(f"{slot.family} {slot.kind}: {episode.house.name}: {episode.instruction}")
    pack = freeze(
        out,
        chosen.episodes,
        chosen.solutions,
        houses,
        name=NAME,
        version=VERSION,
        description="Ten episodes of each family in houses of the project's own, each with a solution.",
        meta={
            "house_generator": generators_of(houses),
            "seed": SEED,
            "simulator": simulator.name,
            "kinds": kinds_of(chosen.episodes),
        },
    )
    write_card(pack)
    return pack


def kinds_of(episodes: Iterable[Episode]) -> dict[str, int]:
    """Returns how many episodes there are of each family, template and difficulty."""
    kinds = [" ".join(filter(None, (e.family, e.provenance.template, e.difficulty))) for e in episodes]
    return dict(sorted(Counter(kinds).items()))


def starter_houses() -> list[House]:
    """Returns the houses of the starter pack."""
    return [_house(index, spec) for index, spec in enumerate(HOUSES)]


def _house(index: int, spec: str) -> House:
    faults: list[SettingError] = []
    for hundred in range(SEED_TRIES):
        try:
            return generate(FIRST_SEED + index + 100 * hundred, spec_for(spec))
        except SettingError as error:
            faults.append(error)
    raise faults[-1]


def _fill(slot: Slot, number: int, houses: list[House], chosen: Chosen, simulator: PrivilegedSimulator) -> Episode:
    """Finds the next episode for a slot, adds it to what is chosen and returns it."""
    validator = Validator(simulator)
    for is_strict, proposals in zip((True, False, False), slot.proposals, strict=False):
        for house in _in_order(slot, houses, chosen):
            key = f"{slot.family} {slot.kind} {number} {house.name}"
            shop = Workshop(simulator, house, np.random.default_rng([SEED, zlib.crc32(key.encode())]))
            for draft in _first(proposals(shop), DRAFTS_PER_HOUSE):
                category = shop.thing(draft.goal.object_id).category
                if is_strict and not chosen.takes(slot.family, category):
                    continue
                verdict = validator.validate(draft, house)
                if verdict.is_valid:
                    chosen.add(draft, verdict.actions, category)
                    return chosen.episodes[-1]
    raise EpisodeError(f"No house yields episode {number + 1} of kind {slot.family} {slot.kind}; add houses.")


def _in_order(slot: Slot, houses: list[House], chosen: Chosen) -> list[House]:
    """Returns the houses that may hold another episode of the slot's family, the least used first."""
    free = [house for house in houses if chosen.family_uses[slot.family, house.name] < PER_HOUSE_AND_FAMILY]
    return sorted(free, key=lambda house: (chosen.uses[house.name], zlib.crc32(f"{slot.kind} {house.name}".encode())))


def _first(drafts: Iterator[Episode], count: int) -> Iterator[Episode]:
    for _, draft in zip(range(count), drafts, strict=False):
        yield draft
