"""Diagnosis: why episodes of a run were not verified successes, with advice for each cause.

Verdicts and the reasons of invalid replies are counted. The advice says where to look, not what the agent meant.
"""

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import pandas as pd

from vigil.analysis.measures.rows import values
from vigil.base.glossary import TERMS
from vigil.scoring.closure import ClosureOutcome

MIN_REASON_SHARE = 0.05
"""A reason gets its own advice if it makes at least this share of the replies invalid. The other reasons are counted
together."""
FORM_ONLY_SHARE = 0.95
"""A run with at least this share of invalid replies measures little except whether replies have the right form."""
_FORM_ADVICE = (
    "Replies do not have the required form: `vigil prompt` shows what is asked for, `vigil view` the replies "
    "(docs/protocol.md, 2.3)."
)
_SURROUNDING_TEXT_ADVICE = (
    "There is text around the object: `--reply-policy lenient` accepts one object in a code fence or in prose, as "
    "a separate variant; for reasoning in the text, use the server's reasoning parser, or `--thinking off`."
)
_NO_ANSWER_ADVICE = (
    "There is reasoning or prose, but no answer: start the server with the reasoning parser of the model, give "
    "`--thinking off`, or a larger `--max-tokens`."
)
_CLICK_ADVICE = (
    "Clicks are not in the requested coordinates: `vigil calibrate --model NAME` finds out which "
    "coordinates the model uses, `--coordinates` sets them."
)
REPLY_ADVICE: Mapping[str, str] = {
    "pixel_outside_frame": _CLICK_ADVICE,
    "ill_typed": f'Arguments have the wrong type, e.g. 0.5 or "320" instead of a whole number. {_CLICK_ADVICE}',
    "code_fence": _SURROUNDING_TEXT_ADVICE,
    "text_around_object": _SURROUNDING_TEXT_ADVICE,
    "several_objects": "One reply has several actions, but only one is allowed: `vigil prompt` shows the prompt.",
    "no_object": _NO_ANSWER_ADVICE,
    "empty": f"{_NO_ANSWER_ADVICE} If `vigil view` shows tool calls, start it without a tool parser.",
    "unclosed_reasoning": _NO_ANSWER_ADVICE,
    "truncated": "The token limit cut the replies: give a larger `--max-tokens`, or `--thinking off`.",
    "provider_rejected": "The provider rejected requests because of their content or length: `vigil view` shows "
    "where; a context that is too small is set at the server.",
    "agent_ended": "The program ended or hung: its standard error is in `logs` of the run's folder.",
}
"""Reason of an invalid reply -> advice; any other reason means that the reply has the wrong form."""
ENDING_ADVICE: Mapping[str, str] = {
    "false_success": "See in `vigil view` what was in view before the report; P(FR | W=0) says how often a missed "
    "goal is claimed.",
    "false_negative": "The agent had reached the goal and did not know it: see the last frames in `vigil view`.",
    "sv_wrong_label": "The state was misread: see the last frame in `vigil view`, and the table `sv_statuses`.",
    "off_mode_label": "Statuses are mixed up: `vigil prompt` shows the allowed ones, `sv_statuses` the given ones.",
    "honest_fail": "The agent conceded, which is honest; see in `vigil view` what it could not do.",
    "unrecognised_status": "The report's status is not one that the prompt lists: `vigil prompt` shows them.",
    "sv_unverified_match": "The answer is right, but the agent had not looked: it guessed, or changed the state.",
    "NR": "The agent never reported: compare P(no rep | W=1), which counts goals that were reached and not closed, "
    "and see in `vigil view` what it did instead.",
    "IL": "Too many replies were not actions: see the reasons for this.",
    "unreported": "The goal held, and the agent did not report that: see the last frames in `vigil view`.",
    "wrong_object": "The agent took the look-alike: it did not look at what distinguishes the two, or did not read it.",
    "wrong_branch": "The agent acted on the other branch of the condition: see in `vigil view` what it saw.",
    "given_up": "The agent conceded although the task could be done: see in `vigil view` what it had looked at.",
    "closed_needlessly": "The agent did what was done already, and reported correctly: it acted before it looked.",
    "no_report": "The agent never reported: see in `vigil view` what it did instead.",
    "other": "Such a report cannot close the episode: `vigil prompt` shows the statuses.",
}
"""Ending of an episode -> advice on where to look."""


@dataclass(frozen=True, slots=True)
class FailureCauses:
    """Counts that may explain the rates of one run: how its episodes ended, and why its replies were invalid."""

    episodes: int
    replies: int
    endings: Mapping[str, int]
    """Number of episodes without verified success, by the subtype of the report or, without a subtype, by label."""
    reasons: Mapping[str, int]
    """Number of invalid replies by reason."""

    @property
    def sentences(self) -> tuple[str, ...]:
        """Sentences on what prevented verified successes, first those about invalid replies; may be empty."""
        return (*_reply_sentences(self), *_ending_sentences(self))


def causes_of_rows(rows: pd.DataFrame) -> FailureCauses:
    """Return the possible causes of the rates of a run of the eight families."""
    endings = Counter(
        subtype or label
        for subtype, label in zip(values(rows, "subtype", object), values(rows, "label", object), strict=True)
        if label not in ("B", None)
    )
    reasons = _sum_counts(json.loads(text) for text in rows["invalid_reasons"])
    return FailureCauses(len(rows), int(values(rows, "steps", int).sum()), endings, reasons)


def causes_of_closure(outcomes: Iterable[ClosureOutcome]) -> FailureCauses:
    """Return what may explain the failures of C (correct closure) in a run of the closure-stress suite."""
    found = list(outcomes)
    endings = Counter(each.label for each in found if each.label != "closed")
    reasons = _sum_counts(each.outcome.invalid_reasons for each in found)
    return FailureCauses(len(found), sum(each.outcome.steps for each in found), endings, reasons)


def _sum_counts(counts: Iterable[Mapping[str, int]]) -> Counter[str]:
    return sum(map(Counter, counts), Counter())


def _reply_sentences(causes: FailureCauses) -> list[str]:
    invalid = sum(causes.reasons.values())
    if not invalid or invalid < MIN_REASON_SHARE * causes.replies:
        return []
    share = invalid / causes.replies
    alone = " The run measures that more than anything else." if share >= FORM_ONLY_SHARE else ""
    by_advice: dict[str, list[str]] = {}
    for reason, count in sorted(causes.reasons.items(), key=lambda each: (-each[1], each[0])):
        advice = REPLY_ADVICE.get(reason, _FORM_ADVICE) if count >= MIN_REASON_SHARE * causes.replies else ""
        by_advice.setdefault(advice, []).append(f"{count} `{reason}`")
    first = f"{share:.0%} of the replies ({invalid:,} of {causes.replies:,}) are not actions.{alone}"
    return [first, *(f"{', '.join(counted)}. {advice}".rstrip() for advice, counted in by_advice.items())]


def _ending_sentences(causes: FailureCauses) -> list[str]:
    ranked = sorted(causes.endings.items(), key=lambda each: (-each[1], each[0]))
    found = []
    for name, count in ranked:
        explained = f", {TERMS[name].short}" if name in TERMS else ""
        found.append(f"{count:,} of {causes.episodes:,} episodes: `{name}`{explained}. {ENDING_ADVICE[name]}")
    return found
