"""Writes the tables of the docs that stand in the source too: `python scripts/docs_tables.py`.

A table stands in a page between `<!-- table: NAME -->` and `<!-- end of table -->`.
"""

import re
from collections.abc import Callable, Iterable
from pathlib import Path

from vigil.analysis.measures.columns import COLUMNS
from vigil.analysis.tables.paper_index import PARTS
from vigil.authoring.solving.flawed.ablated_solvers import ABLATIONS
from vigil.base.glossary import SECTIONS
from vigil.cli.models import LISTED, switch_of
from vigil.integrations.exports.steps import STEP_COLUMNS
from vigil.integrations.gymnasium import GymnasiumOptions
from vigil.protocol.actions import INTENT_ALIASES, INTENTS
from vigil.protocol.families import FAMILIES
from vigil.protocol.finish_reasons import FINISH_REASONS, MEANINGS, REFERENCES
from vigil.protocol.profile import COORDINATES_BY_MODEL
from vigil.runner.inspect_task import TASK_SETTINGS
from vigil.runner.models.providers import parse_model_name
from vigil.scoring.levels import COSTS, LEVELS
from vigil.sim.thor.differences import DIFFERENCES
from vigil.thor.actions.missing import MISSING
from vigil.thor.actions.table import ACTIONS

DOCS = Path(__file__).parents[1] / "docs"
PAGES = (
    "agents.md",
    "ai2thor.md",
    "analysis.md",
    "difficulty.md",
    "export.md",
    "glossary.md",
    "gymnasium.md",
    "inspect.md",
    "models.md",
    "reproduce.md",
)
_TABLE = re.compile(r"(<!-- table: (\w+) -->\n).*?(<!-- end of table -->)", re.DOTALL)


def providers() -> str:
    """Return the providers of models."""
    rows = []
    for name in LISTED:
        one = parse_model_name(f"{name}/m").provider
        keys = " or ".join(f"`{key}`" for key in (one.keys if one.hosts else ()))
        keys = f"the machine's account{' or ' + keys if keys else ''}" if one.signs_in else keys
        address = f"`{one.default_address}`" if one.default_address.startswith("http") else one.default_address
        switch = f"`{switch_of(one)}`" if one.thinking else ""
        extra = f"`{one.extra}`" if one.extra else ""
        tried = "a stand-in" if one.is_in_tests else "a stand-in, by hand"
        rows.append((f"`{name}/...`", one.title, keys, extra, address, switch, tried))
    return _markdown(("name", "provider", "key in", "extra", "address", "thinking on / off", "tried against"), rows)


def coordinates() -> str:
    """Return how models point, by name."""
    rows = [
        (f"`{one.pattern.replace('|', chr(92) + '|')}`", f"`{one.coordinates}`", _linked(one.source))
        for one in COORDINATES_BY_MODEL
    ]
    return _markdown(("in the name, case ignored", "coordinates", "source"), rows)


def finish_reasons() -> str:
    """Return what each finish reason means, and who sends it."""
    rows = []
    for ending, meaning in MEANINGS.items():
        said = [(word, one.senders) for word, one in FINISH_REASONS.items() if one.ending == ending]
        rows.append((ending, "; ".join(f"`{word}` ({senders})" for word, senders in said), meaning))
    return _markdown(("meaning", "words, case ignored (who sends them)", "counts as"), rows)


def finish_reason_sources() -> str:
    """Return where providers list their finish reasons."""
    return _markdown(("sender", "its list"), [(name, f"<{address}>") for name, address in REFERENCES.items()])


def _linked(source: str) -> str:
    address, colon, said = source.partition(": ")
    return f"<{address}>{colon}{said}" if source.startswith("https://") else source


def aliases() -> str:
    """Return the other words for each intent."""
    rows = [
        (f"`{intent}`", ", ".join(f"`{word}`" for word, means in INTENT_ALIASES.items() if means == intent))
        for intent in INTENTS
    ]
    return _markdown(("intent", "also taken"), rows)


def columns() -> str:
    """Return what the columns of rows.csv and rows.parquet say."""
    return _markdown(("column", "says"), [(f"`{name}`", says) for name, says in COLUMNS.items()])


def paper_parts() -> str:
    """Return the paper's tables and figures, their places in a report, and the runs that they need."""
    rows = ((f"`{part.label}`", part.what, f"`{part.place}`", part.needs) for part in PARTS)
    return _markdown(("in the paper", "what it shows", "in the report", "it needs"), rows)


def level_costs() -> str:
    """Return what each figure of an episode adds to its index of difficulty."""
    return _markdown(("figure", "adds"), [(f"`{name}`", cost.formula) for name, cost in COSTS.items()])


def level_bounds() -> str:
    """Return up to which index each level reaches, by family."""
    rows = [
        (family, *(f"{bound:g}" for bound in spec.level_bounds or ()), "above") for family, spec in FAMILIES.items()
    ]
    return _markdown(("family", *LEVELS), rows)


def limited_agents() -> str:
    """Return the agents of limited skill, and what each lacks."""
    return _markdown(
        ("`--agent`", "lacks"), [(f"`{name}`", ablation.description) for name, ablation in ABLATIONS.items()]
    )


def step_columns() -> str:
    """Return what the columns of a dataset's steps say."""
    return _markdown(("column", "says"), [(f"`{name}`", says) for name, (_, says) in STEP_COLUMNS.items()])


def thor_actions() -> str:
    """Return AI2-THOR's actions: which the engine has, and what they lack."""
    had = [(f"`{name}`", "◧" if action.lacks else "■", action.lacks) for name, action in ACTIONS.items()]
    missing = [(f"`{name}`", "□", reason) for name, reason in MISSING.items()]
    return _markdown(("action", "", "what THOR does in addition, or why the action is missing"), sorted(had + missing))


def thor_differences() -> str:
    """Return in what the back end over AI2-THOR differs from the embedded simulator."""
    rows = [
        (
            each.what,
            each.why,
            ", ".join(f"`{kind}`" for kind in each.kinds),
            ", ".join(f"`{name}`" for name in each.checks),
        )
        for each in DIFFERENCES
    ]
    return _markdown(("what", "why", "kinds of `compare-backends`", "conformance checks that cannot hold"), rows)


def gymnasium_options() -> str:
    """Return the options of the Gymnasium environment."""
    rows = [
        (f"`{name}`", f"`{field.default!r}`", field.description or "")
        for name, field in GymnasiumOptions.model_fields.items()
    ]
    return _markdown(("option", "default", "is"), rows)


def inspect_arguments() -> str:
    """Return the arguments of Inspect's task."""
    rows = [
        (f"`{name}`", f"`{one.default!r}`", f"{'`false`: ' if one.default is True else ''}{one.setting.help}")
        for name, one in TASK_SETTINGS.items()
    ]
    return _markdown(("argument", "default", "is"), rows)


def glossary() -> str:
    """Return the terms, section by section, each with an anchor."""
    parts = []
    for heading, terms in SECTIONS.items():
        rows = [(f'<a id="{term.anchor}"></a>**{_cell(term.name)}**', _cell(term.text)) for term in terms]
        parts.append(f"\n## {heading}\n\n{_markdown(('term', 'means'), rows)}\n")
    return "".join(parts)


TABLES: dict[str, Callable[[], str]] = {
    "providers": providers,
    "coordinates": coordinates,
    "finish_reasons": finish_reasons,
    "finish_reason_sources": finish_reason_sources,
    "aliases": aliases,
    "columns": columns,
    "step_columns": step_columns,
    "paper_parts": paper_parts,
    "level_costs": level_costs,
    "level_bounds": level_bounds,
    "limited_agents": limited_agents,
    "thor_actions": thor_actions,
    "thor_differences": thor_differences,
    "glossary": glossary,
    "gymnasium_options": gymnasium_options,
    "inspect_arguments": inspect_arguments,
}


def with_tables(page: str) -> str:
    """Return a page's text with its tables as the source has them."""
    return _TABLE.sub(lambda match: f"{match[1]}{TABLES[match[2]]()}\n{match[3]}", page)


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _markdown(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    lines = [list(heads), *map(list, rows)]
    lines.insert(1, ["---"] * len(lines[0]))
    return "\n".join(f"| {' | '.join(line)} |".replace("|  |", "| |").replace("|  |", "| |") for line in lines)


if __name__ == "__main__":
    for name in PAGES:
        path = DOCS / name
        path.write_text(with_tables(path.read_text(encoding="utf-8")), encoding="utf-8")
