"""Protocol tables: those of the paper's tables that say what is run, rendered from the very data that runs it."""

from vigil.actions import INTENTS, SKILLS, STATUSES
from vigil.analysis.paper import paper
from vigil.analysis.study import Study
from vigil.analysis.table import Column, Row, Table
from vigil.episode import FAMILIES

_TIERS = {"diagnostic": "Diagnostic", "compositional": "Compositional"}


def episode_distribution(study: Study) -> Table:
    """Returns how many episodes of each family the runs' packs hold, as far as they were to be played."""
    packs: dict[str, dict[str, int]] = {}
    for entry in study.entries:
        spec = entry.run.header.spec
        name = f"{spec.pack} {spec.pack_sha256[:8]}"
        ours = {family: count // spec.epochs for family, count in entry.run.planned.items()}
        known = packs.setdefault(name, {})
        packs[name] = {family: max(known.get(family, 0), ours.get(family, 0)) for family in FAMILIES}
    rows = [
        Row(
            {"family": family, "name": spec.name, "max_steps": spec.max_steps, **{name: packs[name].get(family, 0) for name in packs}},
            group=_TIERS[spec.tier],
        )
        for family, spec in FAMILIES.items()
    ]  # fmt: skip
    rows.append(Row({"family": "All", **{name: sum(packs[name].values()) for name in packs}}, group="All"))
    columns = (
        Column("family", "Family", "text"), Column("name", "Name", "text"),
        *(Column(name, f"Episodes of {name}", "count") for name in sorted(packs)),
        Column("published", "Published pack", "count"), Column("max_steps", "Max. steps", "count"),
    )  # fmt: skip
    rows = [Row({**row.cells, "published": 1000 if row.cells["family"] == "All" else 125}, row.group) for row in rows]
    return Table("episode_distribution", "Episode distribution", columns, tuple(rows))


def family_specs(study: Study) -> Table:
    """Returns the families' budgets and expected skills."""
    del study
    columns = (
        Column("family", "Family", "text"), Column("name", "Name", "text"), Column("visible", "Target visible at start", "text"),
        Column("max_steps", "Steps", "count"), Column("max_invalid", "Invalid limit", "count"),
        Column("skills", "Expected skills", "text"), Column("success", "Success", "text"),
    )  # fmt: skip
    rows = tuple(
        Row(
            {
                "family": family,
                "name": spec.name,
                "visible": "yes" if spec.visible_at_start else "no",
                "max_steps": spec.max_steps,
                "max_invalid": spec.max_invalid,
                "skills": ", ".join(spec.skills),
                "success": " or ".join(spec.goal_kinds),
            },
            group=_TIERS[spec.tier],
        )
        for family, spec in FAMILIES.items()
    )
    return Table("family_specs", "Task families", columns, rows)


def action_specs(study: Study) -> Table:
    """Returns the action space."""
    del study
    columns = tuple(
        Column(key, key.capitalize(), "text") for key in ("skill", "argument", "type", "description", "required")
    )
    rows = tuple(
        Row(
            {
                "skill": skill,
                "argument": argument.name,
                "type": argument.type,
                "description": argument.description,
                "required": "unless intent is drop" if argument.unless_drop else "yes",
            }
        )
        for skill, arguments in SKILLS.items()
        for argument in arguments
    )
    return Table("action_specs", "Action space", columns, rows)


def intents(study: Study) -> Table:
    """Returns the eight intents."""
    del study
    columns = (
        Column("intent", "Intent", "text"),
        Column("semantics", "Semantics", "text"),
        Column("pixel", "Needs (x, y)", "text"),
    )
    rows = tuple(
        Row({"intent": name, "semantics": spec.semantics, "pixel": "yes" if spec.needs_pixel else "no"})
        for name, spec in INTENTS.items()
    )
    return Table("intents", "Canonical intents of interact_pixel", columns, rows)


def report_statuses(study: Study) -> Table:
    """Returns the eight terminal statuses."""
    del study
    columns = (Column("status", "Status", "text"), Column("semantics", "Semantics", "text"))
    rows = tuple(Row({"status": status, "semantics": semantics}) for status, semantics in STATUSES.items())
    return Table("report_statuses", "Terminal report statuses", columns, rows)


def failure_taxonomy(study: Study) -> Table:
    """Returns what each label says: the paper's three, and the two that complete the partition."""
    del study
    columns = (Column("label", "Label", "text"), Column("definition", "Definition", "text"))
    rows = [
        Row({"label": line["label"], "definition": line["definition"]}) for line in paper().tables["failure_taxonomy"]
    ]
    rows += [
        Row({"label": "B", "definition": "Benchmark success: W=1, closed by a report that matches the hidden world state."}),
        Row({"label": "Other", "definition": "A report that matches with W=0: an honest fail, an unrecognised status at a failed goal, or the right state label for a state that was not observable at closure."}),
        Row({"label": "NoRep", "definition": "NR + IL: every episode without a report."}),
    ]  # fmt: skip
    notes = ("B, FR, NR, IL and Other are exclusive and partition all scored episodes.",)
    return Table("failure_taxonomy", "Labels", columns, tuple(rows), notes)


def benchmark_comparison(study: Study) -> Table:
    """Returns the paper's comparison of benchmarks."""
    del study
    headings = {
        "benchmark": "Benchmark", "size": "Size", "task_level": "Task level", "multimodal": "Multimodal", "native": "Native control",
        "fine_grained": "Fine-grained", "decoupled": "Decoupled", "active_termination": "Active termination", "no_feedback": "No feedback",
    }  # fmt: skip
    columns = tuple(Column(key, heading, "count" if key == "size" else "text") for key, heading in headings.items())
    rows = tuple(Row(line, is_published=True) for line in paper().tables["benchmark_comparison"])
    return Table("benchmark_comparison", "Embodied benchmarks compared, as published", columns, rows)
