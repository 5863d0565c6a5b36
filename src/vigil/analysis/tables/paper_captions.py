"""Captions of the paper's tables, for a document that has only these tables."""

_PAIRS = "Each cell is W/B in %. W: the world reached the goal. B: W, and closed by a matching report."
_FAMILIES = (
    "PG: pixel grounding, DA: distance approach, VS: view search, SV: state verification, AI: approach and interact, "
    "SI: search and interact, SM: sequential manipulation, CR: constraint resolving."
)
_NO_REPORT = "NoRep: no report, which is NR + IL."

CAPTIONS: dict[str, str] = {
    "benchmark_comparison": (
        "Embodied benchmarks compared (arXiv:2605.08747). Size: episodes or tasks evaluated. Task level: High, the "
        "agent names whole sub-tasks; Low, it moves step by step. Native control: it moves, turns and points at pixels "
        "instead of naming "
        "objects or calling skills. Fine-grained: results are reported by capacity. Decoupled: what is scored "
        "separately. Active termination: how the agent itself ends an episode. No feedback: the agent does not learn "
        "whether an action succeeded."
    ),
    "global_cross_section": f"Outcomes under native control. {_PAIRS} Δ = W - B in points. {_FAMILIES}",
    "full_panel": f"Primary panel by group of models. {_PAIRS}",
    "extended_panel": (
        "Extended panel: rows with B = 0, or with more than 50 % of the episodes ended at the limit on invalid "
        f"actions, and supplementary variants. Rates in %. {_NO_REPORT}"
    ),
    "prompt_sensitivity": (
        f"Neutral prompt, without the two lines that warn of claims that are not grounded. {_PAIRS}"
    ),
    "proprio_minimal": (
        "Action feedback (+FB) against the base contract. Left: mean number of events per episode; retry: repeat of "
        "an identical interact_pixel. Right: change of the rates, +FB minus base, in points."
    ),
    "counterfactual": (
        "B in % if reports followed a policy. Always: a success report is added to each episode, or replaces its "
        "report (bold if above B). Rand.: one of the two admissible labels at random, in expectation W/2."
    ),
    "belief_lag": (
        "Closure lag and premature commitment. W+: episodes with W=1. Lag: mean steps from attainment to the matching "
        f"report, over episodes with B=1. {_NO_REPORT} FS: episodes in which success is reported with W=0; FS @0: the "
        "share of them, in %, without any progress."
    ),
    "conditional_report": (
        "Report rates given the world, in %. Stop: the episode ends by a report. Tinted: P(rep | W=0) of 85 or more, "
        "and P(no rep | W=1) of 40 or more."
    ),
    "open_repeat_robustness": (
        "Repeated runs under the same settings: mean ± half-range (published: two runs), in %. NR: no report."
    ),
    "failure_taxonomy": (
        "Labels of an episode. B, FR, NR, IL and Other are exclusive and partition all scored episodes."
    ),
    "family_specs": (
        "Task families. Steps and invalid limit: an episode ends at these numbers of steps and invalid replies. "
        "Success: kinds of goals that W can require; all_of: several of them. In CR something is in the way."
    ),
    "episode_distribution": "Episodes of each family.",
    "action_specs": "Action space of the agent.",
    "intents": "Intents of `interact_pixel`.",
    "report_statuses": "Statuses of a report.",
}
"""Table -> its caption. The text after a caption explains the marks of the table's rows."""
PUBLISHED_MARK = "†: as published (arXiv:2605.08747), on other episodes and another simulator."
PRIVILEGED_MARK = "‡: scripted, with access to the hidden state."
