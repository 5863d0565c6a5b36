"""Pages of the documentation site that the source says: the command line, the Python interface, the decisions."""

import ast
from collections.abc import Iterator, Mapping
from pathlib import Path

from typer import Context

from scripts.markdown_pages import read, title_of
from vigil.cli.verbs import VERBS, Group, Verb, load

ROOT = Path(__file__).parents[1]

EXTENDED: dict[str, tuple[str, tuple[str, ...]]] = {
    "agents": (
        "Agents",
        ("agents.agent", "protocol.observation", "protocol.actions", "agents.scripted", "agents.registry"),
    ),
    "goals": (
        "Goals and families",
        (
            "protocol.goals",
            "scoring.goal_check",
            "protocol.episode",
            "protocol.families",
            "protocol.family",
            "authoring.solving.goal_actions",
            "authoring.review.goal_controls",
        ),
    ),
    "simulators": (
        "Simulators",
        (
            "sim",
            "sim.protocol",
            "sim.privileged",
            "sim.scene_editor",
            "sim.conformance",
            "protocol.world",
            "base.geometry",
        ),
    ),
    "assets": (
        "Assets and houses",
        ("assets.catalog", "assets.database", "protocol.house", "housegen", "scene.things"),
    ),
    "packs": (
        "Packs and streams",
        ("packs.pack", "packs.freeze", "authoring.streaming.stream", "authoring.drafting.grammar"),
    ),
    "records": (
        "Records and verdicts",
        (
            "records.record",
            "records.record_file",
            "scoring.saved_run",
            "scoring.outcomes",
            "scoring.rates",
            "scoring.summary",
            "errors",
        ),
    ),
    "analysis": (
        "Tables and figures",
        (
            "analysis.measures.rows",
            "analysis.measures.study",
            "analysis.measures.intervals",
            "analysis.tables.table",
            "analysis.tables.registry",
            "analysis.plots.figures",
            "analysis.report",
        ),
    ),
    "integrations": (
        "Gymnasium, verifiers and TRL",
        (
            "integrations.options",
            "integrations.gymnasium.env",
            "integrations.rewards",
            "integrations.verifiers.env",
            "integrations.verifiers.taskset",
            "integrations.trl.environments",
            "integrations.trl.processors",
        ),
    ),
}
"""The pages about modules that people extend: title and modules of each."""


def reference_pages() -> Iterator[tuple[str, str]]:
    """Yield the path of each page in the site, and its text in Markdown."""
    yield "decisions/index.md", decisions()
    yield "reference/command_line.md", command_line()
    yield "reference/vigil.md", public_names()
    for name, (title, modules) in EXTENDED.items():
        yield f"reference/{name}.md", "\n\n".join([f"# {title}", *(f"::: vigil.{module}" for module in modules)])


def public_names() -> str:
    """Return the page about `import vigil`: every name that it offers, from where it is defined."""
    source = ast.parse(read(ROOT / "src/vigil/api.py"))
    places = {
        alias.asname or alias.name: f"{node.module}.{alias.name}"
        for node in source.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    offered = next(
        ast.literal_eval(node.value)
        for node in source.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
    )
    functions = [name for name in offered if name not in places]
    types = [name for name in offered if name[0].isupper()]
    others = [name for name in offered if name not in (*functions, *types)]
    parts = ["# import vigil", ast.get_docstring(source) or ""]
    for title, names in (("Functions", functions + others), ("Types", types)):
        parts.append(f"## {title}")
        for name in names:
            options = f"    options:\n      heading_level: 3\n      heading: vigil.{name}\n      toc_label: {name}"
            parts.append(f"::: {places.get(name, f'vigil.api.{name}')}\n{options}")
    return "\n\n".join(parts)


def decisions() -> str:
    """Return the list of decisions."""
    lines = [
        "# Decisions",
        "Why VIGIL is built as it is: a page for each decision, never changed in its sense later.",
        "",
    ]
    for path in sorted((ROOT / "docs/decisions").glob("[0-9]*.md")):
        number, _, title = title_of(read(path)).partition(" ")
        lines.append(f"- [{int(number.strip('.:'))}. {title}]({path.name})")
    return "\n".join(lines)


def command_line() -> str:
    """Return the page about every verb and its options, as `--help` has them."""
    head = "# Command line\n\nWhat `vigil VERB --help` says, of every verb."
    return "\n\n".join([head, *_verbs(VERBS, "vigil")])


def _verbs(verbs: Mapping[str, Verb | Group], called: str) -> Iterator[str]:
    for name, verb in verbs.items():
        if isinstance(verb, Group):
            yield from _verbs(verb.verbs, f"{called} {name}")
        elif not verb.is_hidden:
            yield _verb(verb, f"{called} {name}")


def _verb(verb: Verb, called: str) -> str:
    command = load(verb)
    context = Context(command, info_name=called)
    usage = " ".join([called, *command.collect_usage_pieces(context)])
    rows = [each.get_help_record(context) for each in command.get_params(context)]
    lines = [f"| `{name}` | {_cell(says)} |" for name, says in filter(None, rows)]
    table = "\n".join(["| option | says |", "|---|---|", *lines])
    return f"## {called}\n\n{_help(command.help)}\n\n```text\n{usage}\n```\n\n{table}"


def _help(text: str) -> str:
    """Return the help of a verb with its examples as code."""
    lines = [line.removeprefix("Examples:").removeprefix("Example:").strip() for line in text.splitlines()]
    said = "\n".join(line for line in lines if not line.startswith("vigil ")).strip()
    examples = "\n".join(line for line in lines if line.startswith("vigil "))
    return said + (f"\n\n```sh\n{examples}\n```" if examples else "")


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;").replace("\n", " ")
