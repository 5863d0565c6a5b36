"""The card of a pack: a README that describes its content and its solutions, with Hugging Face's configuration.

The card is not part of the pack's hash, so that it can be written again after baselines were measured on the frozen
pack. Its text comes from the template `vigil/authoring/templates/pack.md`.
"""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vigil.authoring.cards import CARD, render_card
from vigil.authoring.packing.baselines import baselines_table, guess_lines, read_baselines, strongest_lines
from vigil.authoring.packing.reader_plays import plays_table, read_plays
from vigil.packs.pack import Pack
from vigil.packs.private import is_private
from vigil.protocol.actions import SKILLS, Action
from vigil.protocol.families import FAMILIES, Family
from vigil.scoring.levels import LEVELS

TABLES = ("episodes", "solutions", "facts", "levels", "closure", "chores")
"""Tables (`<table>.jsonl`, a row per line) that a pack may have. Hugging Face `datasets` loads the first by default."""


def write_card(pack: Pack) -> Path:
    """Write the card into the pack's folder and return its path."""
    path = pack.folder / CARD
    path.write_text(card_of(pack), encoding="utf-8")
    return path


def card_of(pack: Pack) -> str:
    """Return the text of a pack's README."""
    meta, measured, played = pack.manifest.meta, read_baselines(pack), read_plays(pack)
    graded: Mapping[str, Mapping[str, int]] = meta.get("levels", {})
    return render_card(
        "pack",
        manifest=pack.manifest,
        meta=meta,
        sha256=pack.sha256,
        is_private=is_private(meta),
        tables=[table for table in TABLES if f"{table}.jsonl" in pack.manifest.files],
        families=FAMILIES,
        steps=steps_of(pack),
        budgets=_budgets(pack),
        skills=list(SKILLS),
        shares=skill_shares(pack),
        levels=[level for level in LEVELS if any(level in counts for counts in graded.values())],
        sources=_sources(meta),
        baselines=[] if measured is None else baselines_table(measured),
        notes=[] if measured is None else [*strongest_lines(measured), *guess_lines(measured)],
        drawn="" if played is None else played.drawn,
        plays=[] if played is None else plays_table(played),
    )


def _budgets(pack: Pack) -> dict[str, list[str]]:
    """Return family -> ranges of the budgets of steps and invalid replies, for families with several budgets."""
    found: dict[str, list[str]] = {}
    for family in {episode.family for episode in pack.episodes}:
        budgets = [(each.max_steps, each.max_invalid) for each in pack.episodes if each.family == family]
        if len(set(budgets)) > 1:
            found[family] = [f"{min(column)} to {max(column)}" for column in zip(*budgets, strict=True)]
    return found


def _sources(meta: Mapping[str, Any]) -> list[tuple[str, int]]:
    """Return (dataset, number of its houses in the pack), sorted, for the houses that were not generated."""
    rows = meta.get("house_sources", {}).values()
    named = (" ".join(filter(None, (row["dataset"], row.get("split"), row.get("revision")))) for row in rows)
    return sorted(Counter(named).items())


def steps_of(pack: Pack) -> dict[Family, dict[str, float]]:
    """Return for each family the mean and the maximum number of steps of its solutions, and its step budget."""
    found: dict[Family, dict[str, float]] = {}
    for family, solutions in _solutions(pack).items():
        steps = [len(actions) for actions in solutions]
        mean, budget = round(sum(steps) / len(steps), 2), FAMILIES[family].max_steps
        found[family] = {"mean": mean, "max": max(steps), "budget": budget}
    return found


def skill_shares(pack: Pack) -> dict[Family, dict[str, float]]:
    """Return family -> skill -> share of the family's episodes whose solution uses the skill."""
    found: dict[Family, dict[str, float]] = {}
    for family, solutions in _solutions(pack).items():
        counts = Counter(skill for actions in solutions for skill in {action.skill_name for action in actions})
        found[family] = {skill: round(counts[skill] / len(solutions), 4) for skill in sorted(counts)}
    return found


def _solutions(pack: Pack) -> dict[Family, list[tuple[Action, ...]]]:
    """Return family -> the actions of each of its solutions, in the usual order of families."""
    found: dict[Family, list[tuple[Action, ...]]] = {family: [] for family in FAMILIES}
    for episode in pack.episodes:
        found[episode.family].append(pack.solutions[episode.id].actions)
    return {family: listed for family, listed in found.items() if listed}
