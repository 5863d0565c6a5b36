"""The starter pack: 80 episodes in generated houses. One function proposes, validates, solves and freezes them.

The pack depends only on the tables below and on the versions of the generator and the assets, so that the same code
makes the same bytes.
"""

import zlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

import numpy as np

from vigil.authoring.drafting.drafts import id_stem
from vigil.authoring.drafting.grammar import Proposals, kinds_of
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.packing.dataset_card import write_card
from vigil.authoring.review.validate import Validator
from vigil.errors import EpisodeError, SettingError
from vigil.housegen.base.spec import spec_for
from vigil.housegen.document import generators_of
from vigil.housegen.generate import generate
from vigil.packs.freeze import freeze
from vigil.packs.pack import Pack
from vigil.protocol.actions import Action
from vigil.protocol.episode import Episode, Solution
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.house import House
from vigil.sim.privileged import PrivilegedSimulator

NAME = "starter"
VERSION = "4"
SEED = 2026
DRAFTS_PER_HOUSE = 6
PER_HOUSE_AND_FAMILY = 2
CATEGORY_USES = 3
"""Maximum number of episodes about the same category. No two of them are of the same family."""
FIRST_SEED, SEED_TRIES, SEED_STRIDE = 101, 5, 100
"""Seed of the first house, number of seeds tried for each house, and step between these seeds."""

HOUSES = (
    *("kitchen-living", "kitchen-living", "kitchen-living", "kitchen-living"),
    *("bedroom-living", "bedroom-living", "bedroom-living", "bedroom-living"),
    *("bedroom-bathroom", "bedroom-bathroom", "2-room", "2-room"),
    *("kitchen", "kitchen", "kitchen", "kitchen", "living-room", "living-room", "living-room"),
    *("bedroom", "bedroom", "bedroom", "bathroom", "bathroom"),
)
"""Specs of the houses. For the house at index i, the seeds FIRST_SEED + i, FIRST_SEED + i + SEED_STRIDE, ... are tried;
the first valid seed is used."""


@dataclass(frozen=True, slots=True)
class EpisodeQuota:
    """A kind of episode, and how many episodes of this kind the pack has."""

    family: Family
    kind: str
    count: int
    fallback: str | None = None
    """Kind that is proposed instead if no house yields the kind itself; None if there is no such kind."""

    @property
    def proposals(self) -> list[Proposals]:
        """Functions to try in turn: for a category not used yet, for any category, then for the fallback kind."""
        kinds = kinds_of(self.family)
        return [kinds[self.kind], kinds[self.kind], *([kinds[self.fallback]] if self.fallback else [])]


QUOTAS = tuple(
    EpisodeQuota(family, name, kind.in_starter, kind.fallback)
    for family, spec in reversed(FAMILIES.items())
    for name, kind in sorted(spec.kinds.items(), key=lambda item: item[1].fallback is None)
    if kind.in_starter
)
"""Quotas of the pack. The rarest kinds come first, so that suitable houses are still free for them."""


@dataclass(slots=True)
class StarterSelection:
    """The episodes chosen so far."""

    episodes: list[Episode] = field(default_factory=list)
    solutions: list[Solution] = field(default_factory=list)
    uses: Counter[tuple[str, ...]] = field(default_factory=Counter)
    """"house" or "category", its name, and maybe a family -> number of chosen episodes."""

    def takes(self, family: str, category: str) -> bool:
        """Return whether the limits allow an episode of this family about this category."""
        return not self.uses["category", category, family] and self.uses["category", category] < CATEGORY_USES

    def add(self, episode: Episode, actions: tuple[Action, ...], category: str, house: House) -> None:
        """Add a valid episode, and give it its final id."""
        provenance = episode.provenance.model_copy(update={"validated": True, "solution_steps": len(actions)})
        episode_id = self._id(episode, category, house)
        self.episodes.append(episode.model_copy(update={"id": episode_id, "provenance": provenance}))
        self.solutions.append(Solution(episode_id=episode_id, actions=actions))
        keys = ("house", episode.house.name), ("category", category)
        self.uses.update([*keys, *((*key, episode.family) for key in keys)])

    def _id(self, episode: Episode, category: str, house: House) -> str:
        taken = {each.id for each in self.episodes}
        plain = id_stem(episode, category, house)
        family = f"{plain}_{episode.family.lower()}"
        more = (f"{family}{number}" for number in range(2, len(taken) + 3))
        return next(each for each in (plain, family, *more) if each not in taken)


def build_starter(out: Path, simulator: PrivilegedSimulator, report: Callable[[str], None] = lambda line: None) -> Pack:
    """Write the starter pack into a missing or empty folder, and return it; `report` gets a line for each episode.

    Raises EpisodeError if no house yields an episode of some kind, SettingError if the folder is not empty.
    """
    houses = [_house(index, spec) for index, spec in enumerate(HOUSES)]
    chosen = StarterSelection()
    for slot in QUOTAS:
        for number in range(slot.count):
            episode = _fill(slot, number, houses, chosen, simulator)
            report(f"{slot.family} {slot.kind}: {episode.house.name}: {episode.instruction}")
    kinds = Counter(" ".join(filter(None, (e.family, e.provenance.template, e.target_size))) for e in chosen.episodes)
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
            "kinds": dict(sorted(kinds.items())),  # text "FAMILY TEMPLATE SIZE" -> number of such episodes
        },
    )
    write_card(pack)
    return pack


def _house(index: int, spec: str) -> House:
    faults: list[SettingError] = []
    for number in range(SEED_TRIES):
        try:
            return generate(FIRST_SEED + index + SEED_STRIDE * number, spec_for(spec))
        except SettingError as error:
            faults.append(error)
    raise faults[-1]


def _fill(
    slot: EpisodeQuota, number: int, houses: list[House], chosen: StarterSelection, simulator: PrivilegedSimulator
) -> Episode:
    """Find the next episode for a quota, add it to `chosen` and return it."""
    validator = Validator(simulator, is_draft=True)
    for is_strict, proposals in zip((True, False, False), slot.proposals, strict=False):
        for house in _in_order(slot, houses, chosen):
            key = f"{slot.family} {slot.kind} {number} {house.name}"
            context = HouseContext(simulator, house, np.random.default_rng([SEED, zlib.crc32(key.encode())]))
            for draft in islice(proposals(context), DRAFTS_PER_HOUSE):
                category = context.thing(draft.goal.object_id).category
                if is_strict and not chosen.takes(slot.family, category):
                    continue
                verdict = validator.validate(draft, house)
                if verdict.is_valid:
                    chosen.add(draft, verdict.actions, category, house)
                    return chosen.episodes[-1]
    raise EpisodeError(f"No house yields episode {number + 1} of kind {slot.family} {slot.kind}; add houses.")


def _in_order(slot: EpisodeQuota, houses: list[House], chosen: StarterSelection) -> list[House]:
    """Return the houses that may get another episode of the quota's family, those with the fewest episodes first."""
    free = [house for house in houses if chosen.uses["house", house.name, slot.family] < PER_HOUSE_AND_FAMILY]
    return sorted(
        free, key=lambda house: (chosen.uses["house", house.name], zlib.crc32(f"{slot.kind} {house.name}".encode()))
    )
