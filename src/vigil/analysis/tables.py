"""The registry of tables: the paper's sixteen by their names, and those beside them."""

from collections.abc import Callable

from vigil.analysis import comparison_tables, own_tables, protocol_tables, result_tables
from vigil.analysis.study import Study
from vigil.analysis.table import Table

Builder = Callable[[Study], Table]

PAPER_TABLES: dict[str, Builder] = {
    "global_cross_section": result_tables.global_cross_section,
    "full_panel": result_tables.full_panel,
    "extended_panel": result_tables.extended_panel,
    "proprio_minimal": result_tables.proprio_minimal,
    "counterfactual": result_tables.counterfactual,
    "belief_lag": result_tables.belief_lag,
    "conditional_report": result_tables.conditional_report,
    "prompt_sensitivity": result_tables.prompt_sensitivity,
    "open_repeat_robustness": result_tables.open_repeat_robustness,
    "episode_distribution": protocol_tables.episode_distribution,
    "family_specs": protocol_tables.family_specs,
    "action_specs": protocol_tables.action_specs,
    "intents": protocol_tables.intents,
    "report_statuses": protocol_tables.report_statuses,
    "failure_taxonomy": protocol_tables.failure_taxonomy,
    "benchmark_comparison": protocol_tables.benchmark_comparison,
}
OWN_TABLES: dict[str, Builder] = {
    "runs": own_tables.runs,
    "overview": own_tables.overview,
    "family_rates": own_tables.family_rates,
    "clustered": comparison_tables.clustered,
    "outcome_partition": own_tables.outcome_partition,
    "regimes": own_tables.regime_table,
    "comparisons": comparison_tables.comparisons,
    "comparable_pairs": comparison_tables.comparable_pairs,
    "after_goal": own_tables.after_goal,
    "sv_statuses": own_tables.sv_statuses,
    "composition": own_tables.composition,
    "stop_only": own_tables.stop_only,
    "invalid_replies": own_tables.invalid_replies,
    "power": comparison_tables.power,
}
TABLES: dict[str, Builder] = {**PAPER_TABLES, **OWN_TABLES}


def tables(study: Study) -> dict[str, Table]:
    """Returns every table of a report by name, in the registry's order."""
    return {name: build(study) for name, build in TABLES.items()}
