"""Pairs: what is recognised from headers alone, and what is refused by name."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.published_runs import (
    PUBLISHED,
    SMALL,
    EpisodeScript,
    Write,
    make_episodes,
    record_of,
    records_of,
    small_records,
    write_pack,
    write_run,
)
from tests.support.quick_runs import claim
from vigil.analysis.measures.pairs import compare_runs, family_differences, find_pairs, make_pair, shared_rows
from vigil.analysis.measures.rows import Run, read_runs
from vigil.analysis.measures.study import study
from vigil.analysis.measures.transitions import label_matrix, transitions
from vigil.analysis.tables.registry import tables
from vigil.errors import RecordError
from vigil.protocol.families import Family
from vigil.protocol.profile import ACTION_FEEDBACK, Profile
from vigil.protocol.prompt_file import variant_of
from vigil.records.record import EpisodeRecord, ProviderFacts, read_header

FEEDBACK, NEUTRAL = Profile(name=ACTION_FEEDBACK), Profile(prompt_variant="neutral_report")


def missed() -> dict[str, EpisodeRecord]:
    """Every second episode is left unreported."""
    found = small_records()
    for family in PUBLISHED:
        found[f"{family}-000"] = record_of(EpisodeScript(family, True, "NR"))
    return found


def runs_of(write: Write, *settings: dict[str, Any]) -> list[Run]:
    return read_runs([write(f"run{index}", **one) for index, one in enumerate(settings)])


def test_interventions_are_recognised_from_headers(write: Write):
    found = find_pairs(runs_of(write, {"profile": NEUTRAL}, {"profile": FEEDBACK}, {}))
    (feedback,), (prompt,) = found.feedback, found.prompt
    assert (feedback.base.name, feedback.other.name) == ("model", "model [+FB]")
    assert (prompt.base.name, prompt.other.name) == ("model", "model [neutral_report]")
    assert found.refusals == ()
    assert found.repeats == ()


def own_prompt(template: str, **more: Any) -> Profile:
    return Profile(prompt_variant=variant_of(template), prompt_template=template, **more)


def test_a_prompt_file_is_no_variant_of_the_papers_prompt(write: Write):
    """It is paired with its own runs alone, stands in no table of the default contract, and its name says it."""
    mine, changed = own_prompt("Do <TASK_INSTRUCTION>"), own_prompt("Please do <TASK_INSTRUCTION>")
    fed = own_prompt("Do <TASK_INSTRUCTION>", name=ACTION_FEEDBACK)
    runs = runs_of(write, {}, {"profile": NEUTRAL}, {"profile": mine}, {"profile": changed}, {"profile": fed})
    found = find_pairs(runs)
    (prompt,), (feedback,) = found.prompt, found.feedback
    assert (prompt.base.name, prompt.other.name) == ("model", "model [neutral_report]")
    assert feedback.base.name == f"model [{mine.prompt_variant}]"
    assert feedback.other.name == f"model [+FB, {mine.prompt_variant}]"
    assert (found.repeats, found.refusals) == ((), ())
    assert [entry.name for entry in study(runs).main_runs()] == ["model"]


def test_a_prompt_file_is_named_also_where_no_other_run_is_near(write: Write):
    mine = own_prompt("Do <TASK_INSTRUCTION>")
    assert [run.name for run in runs_of(write, {"profile": mine})] == [f"model [{mine.prompt_variant}]"]


def test_another_revision_of_the_prompt_is_no_variant(write: Write):
    base, other = runs_of(write, {}, {"profile": NEUTRAL})
    policy = other.header.spec.prompt_policy.replace(".v1/", ".v2/")
    spec = other.header.spec.model_copy(update={"prompt_policy": policy})
    other = Run(**{**vars(other), "header": other.header.model_copy(update={"spec": spec})})
    with pytest.raises(RecordError, match=r"cannot be paired for prompt, .*: prompt_policy is '.*v2"):
        make_pair(base, other, "prompt")


def test_pairing_is_symmetric(write: Write):
    base, other = runs_of(write, {}, {"profile": FEEDBACK})
    assert make_pair(base, other, "feedback") == make_pair(other, base, "feedback")


def test_other_settings_are_refused_by_name(write: Write):
    settings = {"profile": FEEDBACK, "sampling": {"temperature": 0.5}}
    found = find_pairs(runs_of(write, {}, settings))
    assert found.feedback == ()
    (refusal,) = found.refusals
    assert "sampling.temperature is not set in one, 0.5 in the other" in refusal


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"agent": "vllm/other"}, "agent is 'vllm/model' in one, 'vllm/other' in the other"),
        ({"simulator": "fake"}, "simulator is 'mujoco' in one, 'fake' in the other"),
        ({"planned": [f"{family}-000" for family in PUBLISHED]}, "episode_ids is a list of 16 in one, a list of 8"),
        ({"pack_sha256": "1" * 64}, "pack_sha256"),
    ],
)
def test_different_runs_are_refused_by_name(write: Write, change: dict[str, Any], named: str):
    facts = dict(change)
    sha256 = facts.pop("pack_sha256", None)
    planned = facts.get("planned")
    records = {key: record for key, record in small_records().items() if planned is None or key in planned}
    base, other = (*runs_of(write, {}), *read_runs([write("other", records, **facts)]))
    if sha256:
        spec = other.header.spec.model_copy(update={"pack_sha256": sha256})
        other = Run(**{**vars(other), "header": other.header.model_copy(update={"spec": spec})})
    with pytest.raises(RecordError, match="cannot be paired for repeat") as caught:
        make_pair(base, other, "repeat")
    assert named in str(caught.value)


def test_two_interventions_at_once_are_no_pair(write: Write):
    both = Profile(name=ACTION_FEEDBACK, prompt_variant="neutral_report")
    found = find_pairs(runs_of(write, {}, {"profile": both}))
    assert (found.feedback, found.prompt, found.refusals) == ((), (), ())


THINKING = {"extra_body": {"chat_template_kwargs": {"enable_thinking": True}}}


@pytest.mark.parametrize(
    ("instruct", "thinking"),
    [
        ({}, {"sampling": THINKING}),
        ({"sampling": {"reasoning_effort": "none"}}, {"sampling": {"reasoning_effort": "high"}}),
        ({"agent": "vllm/Qwen3-VL-8B-Instruct"}, {"agent": "vllm/Qwen3-VL-8B-Thinking"}),
    ],
)
def test_serving_modes_of_a_checkpoint_are_paired(write: Write, instruct: dict[str, Any], thinking: dict[str, Any]):
    runs = runs_of(write, thinking, instruct)
    found = find_pairs(runs)
    (one,) = found.serving
    assert (bool(one.base.model.is_thinking), one.other.model.is_thinking) == (False, True)
    assert found.refusals == ()
    (row,) = tables(study(runs, with_paper=False))["serving_modes"].rows
    assert {row.cells[f"{name}_{side}"][0] for name in "WB" for side in ("base", "other")} == {100.0}


def answered(folder: Path, with_reasoning: int, replies: int = 16) -> Path:
    """Writes into a run's header how many of its replies came with reasoning."""
    told = ProviderFacts(replies=replies, replies_with_reasoning=with_reasoning)
    header = read_header(folder).model_copy(update={"answered": told})
    (folder / "run.json").write_text(header.model_dump_json(), encoding="utf-8")
    return folder


def test_what_was_seen_decides_the_serving_mode_and_a_contradiction_is_said(write: Write):
    """The same name and settings: one server passes them on, the other does not."""
    named = {"agent": "vllm/Qwen3-VL-8B-Instruct"}
    runs = read_runs([answered(write("a", **named), 0), answered(write("b", **named), 16)])
    found = study(runs, with_paper=False)
    (one,) = found.pairing.serving
    assert (one.base.folder.name, one.other.folder.name) == ("a", "b")
    assert (one.base.model.is_thinking, one.other.model.is_thinking) == (False, True)
    assert found.pairing.repeats == ()
    (said,) = (warning for warning in found.warnings if "reasoning" in warning)
    assert "Qwen3-VL-8B-Instruct (T)" in said
    assert "16 of its 16 replies (with those to the check before the run) came with reasoning: it counts" in said


def test_a_model_that_is_to_think_and_does_not_is_said(write: Write):
    runs = read_runs([answered(write("a", sampling=THINKING), 0)])
    (said,) = (warning for warning in study(runs, with_paper=False).warnings if "reasoning" in warning)
    assert "none of its 16 replies (with those to the check before the run) came with reasoning" in said
    runs = read_runs([answered(write("b", sampling=THINKING), 16), answered(write("c"), 0)])
    assert not [warning for warning in study(runs, with_paper=False).warnings if "reasoning" in warning]


def test_serving_modes_under_other_settings_are_refused_by_name(write: Write):
    found = find_pairs(runs_of(write, {}, {"sampling": {**THINKING, "temperature": 0.6}}))
    assert found.serving == ()
    assert (
        "cannot be paired for serving, because they also differ in other settings: sampling.temperature"
        in found.refusals[0]
    )


def test_two_baselines_make_one_row_each_for_the_runs_beside_them(write: Write):
    some = {name: record for name, record in small_records().items() if not name.startswith("CR")}
    runs = runs_of(write, {"records": some}, {}, {}, {"profile": FEEDBACK}, {"profile": NEUTRAL})
    found = find_pairs(runs)
    (feedback,), (prompt,) = found.feedback, found.prompt
    assert feedback.base.folder.name == prompt.base.folder.name == "run1"
    assert "'model · run0', 'model · run2' would do as well" in found.choices["feedback"][0]
    made = tables(study(runs, with_paper=False))
    for name in ("proprio_minimal", "prompt_sensitivity", "prompt_shifts", "feedback_events"):
        assert len(made[name].rows) == 1, name


def test_labels_that_change_are_counted_and_tested(write: Write):
    base, other = runs_of(write, {"records": missed()}, {"profile": FEEDBACK})
    (pair_of,) = find_pairs([base, other]).feedback
    matrix = label_matrix(*pair_of.tables())
    assert matrix["NR"]["B"] == matrix["B"]["B"] == 8
    (change,) = transitions(*pair_of.tables())
    assert (change.source, change.target, change.forward, change.backward) == ("B", "NR", 0, 8)
    assert change.net == pytest.approx(-0.5)
    assert np.isclose(change.p, 2 * 0.5**8)


def unreported(family: Family) -> EpisodeScript:
    return EpisodeScript(family, True, "NR")


def test_the_epochs_of_an_episode_change_their_labels_together(write: Write):
    folders = [write("base", epochs=2), write("fb", epochs=2, profile=FEEDBACK)]
    for folder, records in zip(folders, (small_records(unreported), small_records()), strict=True):
        second = {name: record.model_copy(update={"epoch": 2}) for name, record in records.items()}
        extra = (write("extra", second, epochs=2) / "episodes.jsonl").read_bytes()
        with (folder / "episodes.jsonl").open("ab") as file:
            file.write(extra)
        claim(folder)
    (found,) = find_pairs(read_runs(folders)).feedback
    (change,) = transitions(*found.tables())
    assert (change.forward, change.backward) == (0, 16)
    assert change.net == pytest.approx(-0.5)
    assert np.isclose(change.p, 2 * 0.5**16)


def test_a_pair_must_differ_in_what_it_is_about(write: Write):
    first, second = runs_of(write, {}, {})
    with pytest.raises(RecordError, match="are the same"):
        make_pair(first, second, "feedback")


def test_repeats_are_runs_or_epochs_and_seeds_of_models_are_free(write: Write):
    found = find_pairs(runs_of(write, {"seed": 1}, {"seed": 2}, {"seed": 3}))
    assert [(one.name, len(one.tables)) for one in found.repeats] == [("model", 3)]
    again = {name: record.model_copy(update={"epoch": 2}) for name, record in missed().items()}
    twice = write("epochs", small_records(), epochs=2)
    with (twice / "episodes.jsonl").open("ab") as file:
        extra = write("extra", again, epochs=2)
        file.write((extra / "episodes.jsonl").read_bytes())
    claim(twice)
    made = tables(study(read_runs([twice]), with_paper=False))["open_repeat_robustness"]
    (row,) = made.rows
    assert row.cells["runs"] == 2
    assert row.cells["B"] == pytest.approx((75.0, 25.0))


def test_repeats_show_how_many_labels_change_by_themselves(write: Write):
    settings = [{}, {"records": missed()}, {}, {"profile": FEEDBACK, "records": missed()}]
    made = tables(study(runs_of(write, *settings), with_paper=False))
    groups: dict[str, dict[str, Any]] = {}
    for row in made["transitions"].rows:
        groups.setdefault(row.group, {})[row.cells["model"]] = row.cells
    feedback, second, third = groups
    assert feedback == "model · run0 → model [+FB] (+FB)"
    assert (second, third) == ("model · run0 → model · run1 (repeat)", "model · run0 → model · run2 (repeat)")
    assert [sum(cells["n"] for cells in matrix.values()) for matrix in groups.values()] == [16, 16, 16]
    assert [matrix["B"]["NR"] for matrix in groups.values()] == [8, 8, 0]
    tested = [(row.group, row.cells["model"], row.cells["test"]) for row in made["transition_tests"].rows]
    tests = (("all labels", "Stuart-Maxwell: χ² = 8.0, df = 1"), ("B → NR", "McNemar, exact"))
    assert tested == [(name, *test) for name in (feedback, second) for test in tests]


def test_the_epochs_of_one_run_are_repeats_too(write: Write):
    run = write("epochs", small_records(), epochs=2)
    again = {name: record.model_copy(update={"epoch": 2}) for name, record in missed().items()}
    extra = write("extra", again, epochs=2)
    with (run / "episodes.jsonl").open("ab") as file:
        file.write((extra / "episodes.jsonl").read_bytes())
    claim(run)
    (repeats,) = find_pairs(read_runs([run])).repeats
    assert repeats.names == ("model, epoch 1", "model, epoch 2")
    ((name, before, after),) = repeats.compared_with_first()
    assert (name, len(before)) == ("model, epoch 2", 16)
    assert label_matrix(before, after)["B"] == {"B": 8, "FR": 0, "Other": 0, "NR": 8, "IL": 0}


def test_a_scripted_agents_seed_is_a_setting(write: Write):
    settings = [{"agent": "random", "kind": "scripted", "seed": seed} for seed in (1, 2)]
    found = find_pairs(runs_of(write, *settings))
    assert found.repeats == ()
    assert "seed is 1 in one, 2 in the other" in found.refusals[0]


def test_tests_are_over_shared_episodes_only(write: Write):
    some = {name: record for name, record in missed().items() if not name.startswith("CR")}
    runs = read_runs([write("a", agent="vllm/a"), write("b", some, agent="vllm/b")])
    found = compare_runs(*runs)
    assert found.n == len(PUBLISHED) * SMALL - SMALL
    assert found.w.difference == 0.0
    assert found.b.difference == pytest.approx(-0.5)
    assert (found.b.test.only_first, found.b.test.only_second) == (7, 0)
    ours, theirs = shared_rows(runs[0].rows, runs[1].rows)
    assert ours.index.equals(theirs.index)
    back = compare_runs(runs[1], runs[0])
    assert (back.n, back.b.test.p) == (found.n, found.b.test.p)


def test_nothing_is_called_different_without_a_test(write: Write):
    made = tables(study(read_runs([write("a", agent="vllm/a"), write("b", missed(), agent="vllm/b")])))
    (row,) = made["comparisons"].rows
    assert row.cells["verdict"] == "in B"
    fewer = {**small_records(), "AI-000": record_of(EpisodeScript("AI", True, "NR"))}
    made = tables(study(read_runs([write("a", agent="vllm/a"), write("c", fewer, agent="vllm/c")])))
    assert made["comparisons"].rows[0].cells["verdict"] == "not shown"


def test_intervention_table_counts_events_and_differences(write: Write):
    base, other = runs_of(write, {"records": missed()}, {"profile": FEEDBACK})
    made = tables(study([base, other]))["proprio_minimal"]
    row = made.rows[0]
    assert row.cells["dB"] == (pytest.approx(50.0), None, None)  # all houses agree
    assert row.cells["dNR"][0] == pytest.approx(-50.0)
    assert row.cells["dW"][0] == 0.0
    assert row.cells["n"] == 16
    assert np.isclose(row.cells["p_B"], 2 * 0.5**8)
    assert np.isclose(row.cells["p_NR"], 2 * 0.5**8)
    assert row.cells["p_W"] == row.cells["p_FR"] == 1.0


def test_the_largest_shift_of_a_family_has_its_interval(tmp_path: Path):
    write_pack(tmp_path / "pack", make_episodes(10))
    plots = {family: [EpisodeScript(family, True, "on" if family == "SV" else "success")] * 10 for family in PUBLISHED}
    base = write_run(tmp_path / "base", tmp_path / "pack", "vllm/model", records_of(plots))
    plots["CR"] = [EpisodeScript("CR", True, "NR")] * 4 + plots["CR"][4:]
    other = write_run(tmp_path / "neutral", tmp_path / "pack", "vllm/model", records_of(plots), profile=NEUTRAL)
    found = study(read_runs([base, other]), with_paper=False)
    ((size, interval),) = [family_differences(one, "B")["CR B"] for one in found.pairing.prompt]
    assert size == pytest.approx(-0.4)
    assert interval is not None
    (row,) = tables(found)["prompt_shifts"].rows
    shown = row.cells["largest"].replace("−", "-")
    assert shown == f"CR B -40.0 [{100 * interval[0]:.1f}, {100 * interval[1]:.1f}]"


def test_shifts_of_the_prompt_are_tested(write: Write):
    runs = runs_of(write, {"records": missed()}, {"profile": NEUTRAL})
    row = tables(study(runs))["prompt_shifts"].rows[0]
    assert (row.cells["dDelta"][0], row.cells["dNR"][0]) == pytest.approx((-50.0, -50.0))
    assert row.cells["dB"][0] == pytest.approx(50.0)
    assert row.cells["largest"] == "PG B +50.0"
    assert np.isclose(row.cells["p_B"], 2 * 0.5**8)
    assert row.cells["p_W"] == 1.0


def test_copies_of_a_run_are_named(write: Write):
    first, second = read_runs([write("one/run"), write("two/run")])
    assert "are copies of one run" in study([first, second]).warnings[0]
    later = second.header.model_copy(update={"nonce": "f" * 32})
    assert study([first, Run(**{**vars(second), "header": later})]).warnings == ()


def test_packs_are_never_mixed(write: Write):
    first, second = read_runs([write("a", agent="vllm/a"), write("b", agent="vllm/b")])
    spec = second.header.spec.model_copy(update={"pack_sha256": "1" * 64})
    second = Run(**{**vars(second), "header": second.header.model_copy(update={"spec": spec})})
    with pytest.raises(RecordError, match="different packs"):
        compare_runs(first, second)
    found = study([first, second])
    assert found.comparisons == ()
    assert any("different packs" in warning for warning in found.warnings)
