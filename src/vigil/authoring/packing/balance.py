"""Strata over which a pack is balanced, their counts, and the accuracy of guessing states from words only.

Source: the paper's tables `episode_distribution` and `family_specs`. The paper does not balance over houses and things.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

from vigil.authoring.drafting.drafts import DraftFacts
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.goals import ReportStatus
from vigil.scoring.target_strata import distance_band

AREA_BANDS_M2 = (20.0, 40.0)
"""Limits (m2) of the bands of floor area: small houses are below the first, large houses at or above the second."""

StratumMember = tuple[Episode, DraftFacts]


def stratum_of(episode: Episode, facts: DraftFacts) -> str:
    """Return the stratum of an episode within its family. A pack has about equally many episodes of each stratum."""
    stratum = FAMILIES[episode.family].stratum
    if stratum == "target_size":
        return episode.target_size or "medium"
    if stratum == "distance":
        return distance_band(facts.distance_m)
    if stratum == "label":
        return facts.label or episode.provenance.template
    if stratum == "turning":
        return "turn" if facts.is_seen_by_turning else "walk"
    return episode.provenance.template


def area_band(facts: DraftFacts) -> str:
    """Return the band of a house's floor area, in words."""
    small, large = AREA_BANDS_M2
    if facts.area_m2 < small:
        return f"under {small:g} m2"
    return f"{small:g} to {large:g} m2" if facts.area_m2 < large else f"over {large:g} m2"


def count_strata(members: Sequence[StratumMember]) -> dict[str, Any]:
    """Return the manifest's entry `strata`: numbers of episodes by stratum, room count, area, category and house."""
    families: dict[str, dict[str, int]] = {}
    for family in FAMILIES:
        found = [stratum_of(episode, facts) for episode, facts in members if episode.family == family]
        if found:
            families[family] = _counted(found)
    searches = [(episode.family, facts) for episode, facts in members if not FAMILIES[episode.family].visible_at_start]
    return {
        "families": families,
        "not_found_by_turning": {
            family: sum(not facts.is_seen_by_turning for name, facts in searches if name == family)
            for family in sorted({name for name, _ in searches})
        },
        "rooms": _counted(str(facts.rooms) for _, facts in members),
        "house_sizes": _counted(area_band(facts) for _, facts in members),
        "categories": _counted(facts.category for _, facts in members),
        "houses": len({episode.house.name for episode, _ in members}),
        "most_of_a_family_in_a_house": max(
            Counter((episode.family, episode.house.name) for episode, _ in members).values(), default=0
        ),
    }


def text_guess(members: Sequence[StratumMember]) -> float | None:
    """Return the best accuracy of guessing the queried state (SV) from words only; None if there are no SV episodes.

    The guesser knows which label is more common in this pack for each state and category. Chance is 0.5; with few
    episodes, the best guess is well above chance.
    """
    asked: dict[tuple[str, str], Counter[str | None]] = {}
    for episode, facts in members:
        if isinstance(episode.goal, ReportStatus):
            key = facts.category, episode.goal.state
            asked.setdefault(key, Counter())[facts.label] += 1
    total = sum(labels.total() for labels in asked.values())
    return round(sum(max(labels.values()) for labels in asked.values()) / total, 4) if total else None


def _counted(names: Iterable[str]) -> dict[str, int]:
    return dict(sorted(Counter(names).items()))
