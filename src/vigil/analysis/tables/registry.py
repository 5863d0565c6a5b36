"""Registry of tables by section of a report: the paper's sixteen tables under the paper's names, and further tables."""

from collections.abc import Callable

from vigil.analysis.measures.study import Study
from vigil.analysis.tables import (
    comparison,
    interventions,
    paired,
    protocol,
    results,
    run_tables,
    sources_of_change,
    stopping,
)
from vigil.analysis.tables.table import Table

TableBuilder = Callable[[Study], Table]

_PAPERS_RESULTS: dict[str, TableBuilder] = {
    "global_cross_section": results.global_cross_section,
    "full_panel": results.full_panel,
    "extended_panel": results.extended_panel,
    "proprio_minimal": interventions.proprio_minimal,
    "counterfactual": results.counterfactual,
    "belief_lag": results.belief_lag,
    "conditional_report": results.conditional_report,
    "prompt_sensitivity": interventions.prompt_sensitivity,
    "open_repeat_robustness": interventions.open_repeat_robustness,
}
_PAPERS_PROTOCOL: dict[str, TableBuilder] = {
    "episode_distribution": protocol.episode_distribution,
    "family_specs": protocol.family_specs,
    "action_specs": protocol.action_specs,
    "intents": protocol.intents,
    "report_statuses": protocol.report_statuses,
    "failure_taxonomy": protocol.failure_taxonomy,
    "benchmark_comparison": protocol.benchmark_comparison,
}
SECTIONS: dict[str, dict[str, TableBuilder]] = {
    "Findings at a glance": {
        "overview": run_tables.overview,
        "regimes": run_tables.regime_table,
        "outcome_partition": run_tables.outcome_partition,
        "clustered": comparison.clustered,
        "clustered_conditional": comparison.clustered_conditional,
        "published_differences": comparison.published_differences,
        "comparisons": comparison.comparisons,
        "comparable_pairs": comparison.comparable_pairs,
        "power": comparison.power,
    },
    "The paper's tables, with these runs": _PAPERS_RESULTS,
    "Paired runs and repeats": {
        "feedback_events": paired.feedback_events,
        "prompt_shifts": paired.prompt_shifts,
        "profile_shifts": paired.profile_shifts,
        "perturbation_shifts": paired.perturbation_shifts,
        "stop_shifts": stopping.stop_shifts,
        "stop_costs": stopping.stop_costs,
        "true_reports": stopping.true_reports,
        "serving_modes": paired.serving_modes,
        "event_reductions": sources_of_change.event_reductions,
        "gain_sources": sources_of_change.gain_sources,
        "transitions": paired.transition_matrix,
        "transition_tests": paired.transition_tests,
        "repeat_rates": interventions.repeat_rates,
        "several_plays": interventions.several_plays,
        "stability": interventions.stability,
    },
    "Further analyses": {
        "runs": run_tables.runs,
        "models": run_tables.models,
        "family_rates": run_tables.family_rates,
        "family_clustered": comparison.family_clustered,
        "strata": run_tables.strata,
        "levels": run_tables.levels,
        "after_goal": run_tables.after_goal,
        "false_success_progress": sources_of_change.false_success_progress,
        "sv_statuses": run_tables.sv_statuses,
        "composition": run_tables.composition,
        "stop_only": run_tables.stop_only,
        "invalid_replies": run_tables.invalid_replies,
    },
    "Protocol and pack": _PAPERS_PROTOCOL,
}
"""Heading -> table name -> builder, in the order of a report."""
PAPER_TABLES = _PAPERS_RESULTS | _PAPERS_PROTOCOL
TABLES = {name: build for section in SECTIONS.values() for name, build in section.items()}


def tables(study: Study) -> dict[str, Table]:
    """Return every table of a report by name, in the report's order."""
    return {name: build(study) for name, build in TABLES.items()}
