"""Captions of the paper's tables: the texts of `texts.toml`, with the numbers of episodes and the marks explained."""

from collections.abc import Iterable, Sequence

from vigil.analysis.measures.study import Study
from vigil.analysis.tables.table import TEXTS, Table, TableRow

GOALS = {
    "target_grounded": "target pointed at",
    "agent_near_target": "agent near the target",
    "object_state": "object in the asked state",
    "VS object_state": "target seen",
    "report_status": "asked state in view at the end, and never changed",
    "object_held": "object held",
    "object_at_receptacle": "object at its receptacle",
    "all_of": "several of these",
    "CR": "constraint resolved, and ",
}
"""Kind of goal, after a family's code if the words are only for that family -> words in the table of families. A kind
that is not listed is shown by its name. The words of a code alone stand before those of all kinds of the family."""
_EXCLUDED = "from the main results (B = 0 or IL > 50 %)"
_HEADINGS = {
    "Published: the paper's own pack and simulator": "Published",
    "Excluded from the main tables (low compliance or zero B)": f"Excluded {_EXCLUDED}",
    "excluded from the paper's main tables (low compliance or zero B)": f"excluded {_EXCLUDED}",
    "the paper's supplementary variants": "other sizes and serving modes",
    "Extended panel, by the study's word": "Excluded by the study",
    "Supplementary variants, by the study's word": "Other sizes and serving modes",
}
"""Part of a heading in a report -> its words in a paper."""
_SUPPLEMENTARY = "other sizes and serving modes"
PRIVILEGED_MARK = "‡: scripted, with access to the hidden state."
_PUBLISHED_N, _PUBLISHED_PER_FAMILY = 1000, 125
_REPEATS = "open_repeat_robustness"
_BY_MODEL = (
    "global_cross_section",
    "full_panel",
    "extended_panel",
    "prompt_sensitivity",
    "counterfactual",
    "belief_lag",
    "conditional_report",
)
"""Tables in which each row of the study is one run."""
_BY_FAMILY = ("global_cross_section", "full_panel", "prompt_sensitivity")


def shown_heading(group: str) -> str:
    """Return the heading of a group of rows in a paper: short, and explained by the caption."""
    for said, shown in _HEADINGS.items():
        group = group.replace(said, shown)
    return group


def caption(table: Table, study: Study) -> str:
    """Return the caption of a table in a paper, with its numbers of episodes and its marks explained."""
    text = TEXTS[table.name]["caption"].format(**TEXTS["shared"], packs=_packs(study))
    if table.name not in (*_BY_MODEL, _REPEATS, "proprio_minimal"):
        return text
    return " ".join((text, *_bold(table), *_groups(table), *_episodes(table, study), *_marks(table, study)))


def _bold(table: Table) -> list[str]:
    if table.name != "global_cross_section":
        return []
    sides = {row.is_published for row in table.rows if row.bold}
    named = {True: "of the published rows", False: "of this study's rows without ‡"}
    if not sides:
        return []
    return [f"Bold: highest W, highest B, lowest Δ {' and '.join(named[side] for side in sorted(sides))}."]


def _groups(table: Table) -> list[str]:
    """Return the sentences that explain the headings of groups outside the main tables."""
    headings = " ".join({shown_heading(row.group).lower() for row in table.rows})
    found = [TEXTS["shared"]["il"]] if "il > 50" in headings and "{il}" not in TEXTS[table.name]["caption"] else []
    are_apart = "il > 50" in headings and _SUPPLEMENTARY in headings
    return [*found, *([f"{_SUPPLEMENTARY.capitalize()} are listed whatever their B and IL."] if are_apart else [])]


def _episodes(table: Table, study: Study) -> list[str]:
    """Return a sentence with the number of episodes of the study's rows; empty if the table has no such rows."""
    own = [row for row in table.rows if not row.is_published]
    if not own:
        return []
    if table.name == "proprio_minimal":
        return [f"This study: {_span(row.cells['n'] for row in own)} episodes, played under both."]
    if table.name == _REPEATS:
        sizes = _span(len(one) for repeats in study.pairing.repeats for one in repeats.tables)
        return [f"This study: {_span(row.cells['runs'] for row in own)} runs of {sizes} episodes."]
    names = {row.cells["model"] for row in own}
    entries = [entry for entry in study.entries if entry.name in names]
    each = _span(family.n for entry in entries for family in entry.families.values())
    families = f" ({each} in each family)" if table.name in _BY_FAMILY else ""
    return [f"This study: {_span(entry.overall.n for entry in entries)} episodes{families}."]


def _marks(table: Table, study: Study) -> list[str]:
    marks = []
    if any(row.is_published for row in table.rows):
        families = f" ({_PUBLISHED_PER_FAMILY} in each family)" if table.name in _BY_FAMILY else ""
        runs = "two runs of " if table.name == _REPEATS else ""
        marks.append(
            f"†: as published (arXiv:2605.08747), {runs}{_PUBLISHED_N:,} other episodes{families} in another simulator."
        )
    if any(row.is_privileged for row in table.rows):
        marks.append(PRIVILEGED_MARK)
    if any("(T)" in row.cells["model"] for row in table.rows):
        models = study.published.models if study.published else ()
        shown = {row.cells["model"] for row in table.rows if row.is_published}
        others = [f"{each.name}†" for each in models if each.thinking and "(T)" not in each.name and each.name in shown]
        also = f", as {'is' if len(others) == 1 else 'are'} {' and '.join(others)}" if others else ""
        marks.append(f"(T): served in thinking mode{also}.")
    return marks


def _packs(study: Study) -> str:
    names = sorted({entry.run.header.spec.pack for entry in study.entries})
    return f" from its {'pack' if len(names) == 1 else 'packs'} ({', '.join(names)})" if names else ""


def _span(numbers: Iterable[int]) -> str:
    known = sorted(set(numbers)) or [0]
    return f"{known[0]:,}" if len(known) == 1 else f"{known[0]:,}–{known[-1]:,}"


def without_condition(rows: Sequence[TableRow]) -> dict[str, str]:
    """Return {name: name without the condition in brackets} of the rows; unchanged where two would be the same."""
    names = [row.cells["model"] for row in rows]
    short = {name: name.rsplit(" [", 1)[0] if name.endswith("]") else name for name in names}
    return short if len(set(short.values())) == len(names) else {name: name for name in names}
