"""Index of the paper's tables and figures: where each is in a report, and which runs it needs."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from vigil.analysis.tables.table import Column, Table, TableRow, counts, texts

NAME = "paper_index"
HEADING = "Where each table and figure of the paper is"
ABSENT = "not in this report"


@dataclass(frozen=True, slots=True)
class PaperPart:
    """One table or figure of the paper: where it is in a report, and which runs it needs."""

    label: str
    """Label in the paper's LaTeX."""
    what: str
    place: str
    """Name of the table or figure in a report."""
    needs: str
    """Runs, or other input, from which the part is made."""

    @property
    def is_figure(self) -> bool:
        """Whether the part is a figure."""
        return self.label.startswith("fig:")


_MAIN, _NONE = "main runs", "only a run's header"
PARTS = (
    PaperPart("tab:benchmark_comparison", "Embodied benchmarks compared", "benchmark_comparison", _NONE),
    PaperPart("tab:global_cross_section", "Outcomes per family, W/B", "global_cross_section", _MAIN),
    PaperPart("tab:proprio_minimal", "Action feedback", "proprio_minimal", "main runs, and runs with feedback"),
    PaperPart("tab:action_specs", "Action space", "action_specs", _NONE),
    PaperPart("tab:intents", "Eight intents", "intents", _NONE),
    PaperPart("tab:report_statuses", "Eight report statuses", "report_statuses", _NONE),
    PaperPart("tab:failure_taxonomy", "FR, NR and IL", "failure_taxonomy", _NONE),
    PaperPart("tab:family_specs", "Budgets and skills of the families", "family_specs", _NONE),
    PaperPart("tab:episode_distribution", "Episodes of each family", "episode_distribution", "a run on the pack"),
    PaperPart("tab:full_panel", "Primary panel by group, W/B", "full_panel", _MAIN),
    PaperPart("tab:extended_panel", "Extended panel", "extended_panel", "main runs outside the primary panel"),
    PaperPart("tab:counterfactual", "Other report policies", "counterfactual", _MAIN),
    PaperPart("tab:belief_lag", "Closure lag and premature commitment", "belief_lag", _MAIN),
    PaperPart("tab:conditional_report", "Report rates given the world", "conditional_report", _MAIN),
    PaperPart("tab:prompt_sensitivity", "Neutral prompt, W/B", "prompt_sensitivity", "runs with the neutral prompt"),
    PaperPart("tab:open_repeat_robustness", "Repeated runs", "open_repeat_robustness", "main runs, and their repeats"),
    PaperPart("fig:benchmark", "Families in two tiers", "protocol", "the pack"),
    PaperPart("fig:pipeline", "Pipeline of an episode", "pipeline", "one main run"),
    PaperPart("fig:failure_distribution", "Outcome partition, sorted by B", "outcome_partition", _MAIN),
    PaperPart("fig:belief_closure (a)", "Mean belief lag", "belief_closure", _MAIN),
    PaperPart("fig:belief_closure (b)", "Actions after attainment", "belief_closure", _MAIN),
    PaperPart("fig:trajectory_s4_sv", "Trajectories, state verification", "trajectory_sv", "main runs of four models"),
    PaperPart("fig:trajectory_t1_ai", "Trajectories, interaction", "trajectory_ai", "main runs of four models"),
)
"""The paper's sixteen tables and seven figures, in the paper's order."""


def paper_index(tables: Mapping[str, Table], figures: Collection[str]) -> Table:
    """Return the index of a report that has these tables and figures."""
    columns = (
        *texts(label="In the paper", what="What it shows"),
        Column("place", "Here", "link"),
        *counts(rows="Own rows"),
        *texts(needs="It needs"),
    )
    rows = []
    for part in PARTS:
        is_here = part.place in (figures if part.is_figure else tables)
        target = f"figure-{part.place}" if part.is_figure else part.place
        own = None if part.is_figure or not is_here else sum(not row.is_published for row in tables[part.place].rows)
        cells = {"label": part.label, "what": part.what, "needs": part.needs, "rows": own}
        rows.append(TableRow({**cells, "place": target if is_here else ABSENT}))
    notes = ("`vigil study report` draws all figures; `vigil report` draws those without frames.",)
    return Table(NAME, HEADING, columns, tuple(rows), notes)
