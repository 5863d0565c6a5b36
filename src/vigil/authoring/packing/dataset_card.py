"""The card of a pack: a README that describes its content, with the configuration for HF `datasets`.

The card is not part of the pack's hash: it is written again when baselines were measured on the frozen pack.
"""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vigil.authoring.packing.baselines import baselines_table, guess_lines, read_baselines
from vigil.authoring.packing.reader_plays import plays_table, read_plays
from vigil.authoring.packing.rejections import rejection_lines
from vigil.authoring.packing.solution_statistics import skill_shares, steps_of
from vigil.packs.pack import Pack
from vigil.packs.private import is_private
from vigil.protocol.actions import SKILLS
from vigil.protocol.families import FAMILIES
from vigil.scoring.levels import LEVELS

CARD = "README.md"
TABLES = ("episodes", "solutions", "facts", "levels", "closure")
"""Tables (`<table>.jsonl`, one row per line) that a pack may have; HF `datasets` loads the first by default."""

_HEAD = """---
license: apache-2.0
language: en
pretty_name: {name}
tags: [embodied, egocentric, vision-language, evaluation]
configs:
{configs}
---
# {name}

{description}

Frozen episodes for VIGIL, which scores separately whether an embodied agent reached the goal in the world (W) and
whether it closed the episode with a true report (B). The agent sees one egocentric RGB frame per step, and
`instruction`; everything else here is hidden from it.
"""

_PRIVATE = """---
pretty_name: {name}
tags: [embodied, egocentric, vision-language, evaluation]
---
# {name}

{description}

**Private**: made from a secret seed, for measuring and never for training. No licence is given for anything in this
folder, in the drafts next to it, or in the folders of its runs. Only rates may be published, as `vigil score` and
`vigil report` give them, and the hash by which the pack can be proved later.

| | |
|---|---|
| SHA-256 | `{sha256}` |
| episodes | {families} |
| houses | {houses} |
"""

_FIELDS = """## Files
| file | one line is |
|---|---|
| `episodes.jsonl` | an episode: `id`, `family`, `house` (name, SHA-256), `start` pose, `setup` (what is changed \
before it starts), `instruction`, `goal`, `bindings` (role to object), \
`max_steps`, `max_invalid`, `target_size`, `provenance` |
| `solutions.jsonl` | the actions that solve an episode: W = W_strict = B = 1 when replayed |
| `facts.jsonl` | what the pack is balanced over: category, rooms, area, distance, label |
| `levels.jsonl` | the difficulty of an episode: the measures, their index, the level |
| `closure.jsonl` | the correct closing of an episode: its kind, its twin, the accepted statuses, the evidence to look \
at, and the result of the search |
| `houses/<name>.json` | a house in ProcTHOR's format |
| `manifest.json` | counts, strata, how it was made, and the SHA-256 of each file above |

Lengths are in metres, angles in degrees; poses are in AI2-THOR's frame (y up, left-handed).

`datasets.load_dataset("path/to/this/folder", "episodes")` reads a table. It may add nulls for fields that a goal, a
setup or an action does not have, and round floats in them to ten decimal places; `vigil.Pack.load` gives the values in
the file and checks its hashes.
"""

_LIMITS = """## Known limits
- Solutions hold for the version of VIGIL and the simulator named in the manifest; `vigil pack verify` replays them all.
- Instructions are in English; those of the grammar have few sentence forms for each family.
- Ids name the target and are therefore never shown to an agent.
"""


def write_card(pack: Pack) -> Path:
    """Write the card into the pack's folder and return its path."""
    path = pack.folder / CARD
    path.write_text(card_of(pack), encoding="utf-8")
    return path


def card_of(pack: Pack) -> str:
    """Return the text of a pack's README."""
    manifest = pack.manifest
    description = manifest.description or f"{manifest.episodes} episodes of eight families."
    if is_private(manifest.meta):
        head = _PRIVATE.format(
            name=manifest.name,
            description=description,
            sha256=pack.sha256,
            families=_counts(manifest.families),
            houses=manifest.houses,
        )
        return "\n".join(part for part in (head, _measured(pack)) if part)
    head = _HEAD.format(name=manifest.name, description=description, configs=_configs(pack))
    parts = [head, _distribution(pack), _skills(pack), _suite(manifest.meta)]
    if "strata" in manifest.meta:
        parts += [_levels(manifest.meta), _strata(manifest.meta), _making(manifest.meta)]
    return "\n".join(part for part in [*parts, _measured(pack), _played(pack), _fields(pack), _LIMITS] if part)


def _configs(pack: Pack) -> str:
    """Return the pack's tables with the names that HF `datasets` expects."""
    lines: list[str] = []
    for table in TABLES:
        if f"{table}.jsonl" in pack.manifest.files:
            lines += [f"- config_name: {table}", f"  data_files: {table}.jsonl"]
            lines += ["  default: true"] if table == TABLES[0] else []
    return "\n".join(lines)


def _fields(pack: Pack) -> str:
    """Return what each file holds, without rows for tables that this pack lacks."""
    absent = [f"| `{table}.jsonl` |" for table in TABLES if f"{table}.jsonl" not in pack.manifest.files]
    return "".join(line for line in _FIELDS.splitlines(keepends=True) if not line.startswith(tuple(absent)))


def _distribution(pack: Pack) -> str:
    rows = ["## Episodes", "| family | name | episodes | steps | invalid | solution: mean | max |"]
    rows.append("|---|---|---|---|---|---|---|")
    for family, steps in steps_of(pack).items():
        spec, count = FAMILIES[family], pack.manifest.families[family]
        cells = (family, spec.name, count, spec.max_steps, spec.max_invalid, steps["mean"], steps["max"])
        rows.append(f"| {' | '.join(str(cell) for cell in cells)} |")
    return "\n".join(rows) + "\n"


def _skills(pack: Pack) -> str:
    rows = ["Share of the episodes whose solution uses a skill (%):", ""]
    rows += [f"| family | {' | '.join(SKILLS)} |", f"|{'---|' * (len(SKILLS) + 1)}"]
    for family, shares in skill_shares(pack).items():
        rows.append(f"| {family} | {' | '.join(f'{100 * shares.get(skill, 0.0):.0f}' for skill in SKILLS)} |")
    return "\n".join(rows) + "\n"


def _levels(meta: Mapping[str, Any]) -> str:
    """Return the table of episodes by family and level; empty for a pack without levels."""
    found: Mapping[str, Mapping[str, int]] = meta.get("levels", {})
    if not found:
        return ""
    names = [level for level in LEVELS if any(level in counts for counts in found.values())]
    rows = [
        "Episodes by level of difficulty:",
        "",
        f"| family | {' | '.join(names)} |",
        f"|{'---|' * (len(names) + 1)}",
    ]
    rows += [f"| {family} | {' | '.join(str(counts[name]) for name in names)} |" for family, counts in found.items()]
    return "\n".join(rows) + "\n"


def _suite(meta: Mapping[str, Any]) -> str:
    """Return the section about the closure-stress suite; empty for other packs."""
    if "suite" not in meta:
        return ""
    rows = [
        "## Closure stress",
        "The measure is C, correct closure (protocol, section 8); tables of the eight families do not include W and B "
        "of these episodes. The recorded solution of an impossible episode looks at the evidence and concedes.",
        "",
        "| kind | episodes |",
        "|---|---|",
        *(f"| {name} | {count} |" for name, count in meta["kinds"].items()),
        "",
        "Expected rates of agents without sight, in per cent:",
        "",
    ]
    columns = list(next(iter(meta["blind"].values())))
    rows += [f"| agent | {' | '.join(columns)} |", f"|{'---|' * (len(columns) + 1)}"]
    rows += [
        f"| {agent} | {' | '.join(f'{found[column]:.1f}' for column in columns)} |"
        for agent, found in meta["blind"].items()
    ]
    rows += ["", "An agent that acts and reports in the same way on both sides of a pair cannot close it knowingly."]
    return "\n".join(rows) + "\n"


def _measured(pack: Pack) -> str:
    found = read_baselines(pack)
    if found is None:
        return ""
    intro = (
        "Rates in per cent. The blind agents do not look; the privileged ones know hidden state and show how agents "
        "that never report, or report too early, are scored."
    )
    return "\n".join(["## Baselines", intro, "", *baselines_table(found), "", *guess_lines(found), ""])


def _played(pack: Pack) -> str:
    found = read_plays(pack)
    if found is None:
        return ""
    intro = (
        f"{found.drawn} Each was played once, from the requests that a model gets: frame, prompt and history. Failures "
        "are counted by the cause that another reader found; `plays.json` has every play with the reason."
    )
    return "\n".join(["## Played by readers", intro, "", *plays_table(found), ""])


def _strata(meta: Mapping[str, Any]) -> str:
    strata = meta["strata"]
    rows = ["## Strata", "| of | counts |", "|---|---|"]
    rows += [f"| {family} | {_counts(found)} |" for family, found in strata["families"].items()]
    rows += [f"| {name.replace('_', ' ')} | {_counts(strata[name])} |" for name in ("rooms", "house_sizes")]
    rows.append(f"| categories | {_counts(strata['categories'])} |")
    rows.append(f"| searches that turning does not end | {_counts(strata['not_found_by_turning'])} |")
    return "\n".join(rows) + "\n"


def _making(meta: Mapping[str, Any]) -> str:
    reviews, guess = meta["reviews"], meta["text_guess_sv"]
    guessed = (
        []
        if guess is None
        else [f"- A guess of states by category only, knowing the pack, is right in {100 * guess:.0f} %."]
    )
    return "\n".join(
        [
            "## How it was made",
            f"- Proposed by {', '.join(meta['authors'])} in {meta['strata']['houses']} houses; at most "
            f"{meta['strata']['most_of_a_family_in_a_house']} episodes of a family in a house.",
            "- Each episode passed every rule of VIGIL's validation, and its recorded solution was replayed.",
            f"- Reviewed by a person: {reviews['person']}; by models only: {reviews['model']}; by nobody: "
            f"{reviews['none']}.",
            *_robust(meta),
            *_sources(meta),
            *guessed,
            "",
        ]
    )


def _robust(meta: Mapping[str, Any]) -> list[str]:
    """Return the lines about a robust pack and how many candidates were rejected; empty for other packs."""
    if not meta.get("is_robust"):
        return []
    robust = "- Robust: the noisy solver completes each episode in at least 9 of 10 tries; starts have room and a view."
    return [robust, *rejection_lines(meta.get("rejected", {}))]


def _sources(meta: Mapping[str, Any]) -> list[str]:
    """Return the line about the datasets of houses that were not generated; empty if there are none."""
    rows = meta.get("house_sources", {}).values()
    named = Counter(" ".join(filter(None, (row["dataset"], row.get("split"), row.get("revision")))) for row in rows)
    if not named:
        return []
    listed = ", ".join(f"{count} of {name}" for name, count in sorted(named.items()))
    return [f"- Third-party houses, each pinned in the manifest: {listed}. Their own licence applies to them."]


def _counts(found: Mapping[str, int]) -> str:
    return ", ".join(f"{name} {count}" for name, count in found.items())
