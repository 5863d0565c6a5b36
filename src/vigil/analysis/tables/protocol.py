"""Protocol tables: the paper's tables about the protocol, made from the data that the code itself uses."""

from vigil.analysis.measures.paper import paper
from vigil.analysis.measures.study import Study
from vigil.analysis.tables.table import Table, TableRow, cells_of, counts, texts, titled
from vigil.protocol.actions import INTENTS, SKILLS, STATUSES
from vigil.protocol.families import FAMILIES

PUBLISHED_PER_FAMILY = 125
_FURTHER_LABELS = {
    "B": "Benchmark success: W=1, closed by a report that matches the hidden world state.",
    "Other": "A report that matches with W=0: an honest fail, unsafe or invalid (also an unrecognised "
    "status), or the right state label for a state that was not observable at closure.",
    "NoRep": "NR + IL: every episode without a report.",
}
_TIERS = {"diagnostic": "Diagnostic", "compositional": "Compositional"}


def episode_distribution(study: Study) -> Table:
    """Return the number of planned episodes of each family in the runs' packs."""
    packs: dict[str, dict[str, int]] = {}
    for entry in study.entries:
        spec = entry.run.header.spec
        name = f"{spec.pack} {spec.pack_sha256[:8]}"
        ours = {family: count // spec.epochs for family, count in entry.run.planned.items()}
        known = packs.setdefault(name, {})
        packs[name] = {family: max(known.get(family, 0), ours.get(family, 0)) for family in FAMILIES}
    rows = []
    for family, spec in FAMILIES.items():
        cells = {"family": family, "name": spec.name, "max_steps": spec.max_steps}
        planned = {name: known[family] for name, known in packs.items()}
        rows.append(TableRow({**cells, "published_pack": PUBLISHED_PER_FAMILY, **planned}, _TIERS[spec.tier]))
    totals = {name: sum(known.values()) for name, known in packs.items()}
    whole = {"family": "All", "published_pack": len(FAMILIES) * PUBLISHED_PER_FAMILY, **totals}
    rows.append(TableRow(whole, "All"))
    columns = (
        *texts(family="Family", name="Name"),
        *counts(**{name: f"Episodes of {name}" for name in sorted(packs)}),
        *counts(published_pack="Published pack", max_steps="Max. steps"),
    )
    return titled("episode_distribution", columns, rows)


def family_specs(study: Study) -> Table:
    """Return a table of each family's budgets and expected skills."""
    del study
    columns = (
        *texts(
            family=("Family", lambda each: each[0]),
            name=("Name", lambda each: each[1].name),
            visible=("Target visible at start", lambda each: "yes" if each[1].visible_at_start else "no"),
        ),
        *counts(
            max_steps=("Steps", lambda each: each[1].max_steps),
            max_invalid=("Invalid limit", lambda each: each[1].max_invalid),
        ),
        *texts(
            skills=("Expected skills", lambda each: ", ".join(each[1].skills)),
            success=("Success", lambda each: " or ".join(each[1].allowed_goal_kinds)),
        ),
    )
    rows = tuple(TableRow(cells_of(columns, each), _TIERS[each[1].tier]) for each in FAMILIES.items())
    return titled("family_specs", columns, rows)


def action_specs(study: Study) -> Table:
    """Return a table of the action space: the skills and their arguments."""
    del study
    columns = texts(
        skill=("Skill", lambda each: each[0]),
        argument=("Argument", lambda each: each[1].name),
        type=("Type", lambda each: each[1].type),
        description=("Description", lambda each: each[1].description),
        required=("Required", lambda each: "unless intent is drop" if each[1].unless_drop else "yes"),
    )
    pairs = ((skill, argument) for skill, arguments in SKILLS.items() for argument in arguments)
    return titled("action_specs", columns, (TableRow(cells_of(columns, each)) for each in pairs))


def intents(study: Study) -> Table:
    """Return a table of the eight intents of clicks."""
    del study
    columns = texts(intent="Intent", semantics="Semantics", pixel="Needs (x, y)")
    rows = tuple(
        TableRow({"intent": name, "semantics": spec.semantics, "pixel": "yes" if spec.needs_pixel else "no"})
        for name, spec in INTENTS.items()
    )
    return titled("intents", columns, rows)


def report_statuses(study: Study) -> Table:
    """Return a table of the eight statuses of reports."""
    del study
    columns = texts(status="Status", semantics="Semantics")
    rows = tuple(TableRow({"status": status, "semantics": semantics}) for status, semantics in STATUSES.items())
    return titled("report_statuses", columns, rows)


def failure_taxonomy(study: Study) -> Table:
    """Return the meaning of each label: the three labels of the paper, and the two others of the outcome partition."""
    del study
    columns = texts(label="Label", definition="Definition")
    lines = {line["label"]: line["definition"] for line in paper().tables["failure_taxonomy"]} | _FURTHER_LABELS
    rows = [TableRow({"label": label, "definition": definition}) for label, definition in lines.items()]
    return titled("failure_taxonomy", columns, rows)


def benchmark_comparison(study: Study) -> Table:
    """Return the paper's table that compares embodied benchmarks."""
    del study
    columns = (
        *texts(benchmark="Benchmark"),
        *counts(size="Size"),
        *texts(task_level="Task level", multimodal="Multimodal", native="Native control", fine_grained="Fine-grained"),
        *texts(decoupled="Decoupled", active_termination="Active termination", no_feedback="No feedback"),
    )
    rows = tuple(
        TableRow({**line, "benchmark": line["benchmark"].removesuffix(" (Ours)")}, is_published=True)
        for line in paper().tables["benchmark_comparison"]
    )
    return titled("benchmark_comparison", columns, rows)
