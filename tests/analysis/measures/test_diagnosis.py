"""Causes: what kept a run from verified successes, with what to do, for every ending and every reason."""

import json
from pathlib import Path
from typing import get_args

import pandas as pd

from tests.support.published_runs import Write
from vigil.analysis.measures.diagnosis import ENDING_ADVICE, REPLY_ADVICE, FailureCauses, causes_of_rows
from vigil.analysis.measures.rows import read_runs
from vigil.scoring.closure import CLOSURE_LABELS
from vigil.scoring.outcomes import Label, Subtype

GOLDEN = Path(__file__).parents[2] / "golden" / "replies.json"


def test_every_ending_but_success_has_advice() -> None:
    endings = {*get_args(Subtype), *get_args(Label), *CLOSURE_LABELS} - {"B", "FR", "Other", "closed"}
    assert set(ENDING_ADVICE) == endings  # FR and Other always have a subtype


def test_advice_is_about_reasons_that_there_are() -> None:
    known = {case["is"]["reason"] for case in json.loads(GOLDEN.read_text())["replies"] if "reason" in case["is"]}
    assert set(REPLY_ADVICE) - known <= {"agent_ended", "provider_rejected", "truncated"}  # no parser gives these


def test_half_of_the_clicks_outside_the_frame_is_said_with_calibrate() -> None:
    told = " ".join(FailureCauses(4, 40, {}, {"pixel_outside_frame": 20, "not_json": 1}).sentences)
    assert "52% of the replies (21 of 40) are not actions." in told
    assert "20 `pixel_outside_frame`" in told
    assert "vigil calibrate" in told
    assert "more than anything else" not in told
    assert "1 `not_json`" in told
    assert "docs/protocol.md" not in told


def test_no_action_at_all_is_said_with_the_parser_and_the_policy() -> None:
    told = " ".join(FailureCauses(2, 8, {"IL": 2}, {"no_object": 5, "code_fence": 3}).sentences)
    assert "100% of the replies (8 of 8) are not actions. The run measures that more than anything else." in told
    assert "reasoning parser" in told
    assert "--reply-policy lenient" in told
    assert "2 of 2 episodes: `IL`" in told


def test_tool_calls_in_place_of_text_have_advice() -> None:
    told = " ".join(FailureCauses(1, 4, {}, {"empty": 4}).sentences)
    assert "without a tool parser" in told


def test_a_few_invalid_replies_are_not_worth_a_word() -> None:
    assert FailureCauses(10, 100, {}, {"not_json": 4}).sentences == ()


def test_rows_give_the_subtypes(write: Write) -> None:
    (run,) = read_runs([write("run")])
    causes = causes_of_rows(run.rows)
    assert causes.episodes == run.n
    assert causes.replies == run.rows["steps"].sum()
    bad: pd.DataFrame = run.rows.loc[run.rows["label"] != "B"]
    assert causes.endings == dict(bad["subtype"].where(bad["subtype"].notna(), bad["label"]).value_counts())
