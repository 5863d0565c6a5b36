"""A study's file: what it gives, and what it refuses, with line and key."""

from pathlib import Path

import pytest

from vigil.analysis.measures.paper import paper
from vigil.errors import SettingError
from vigil.studies.planned_runs import PlannedRun, labels_of, planned_runs, selected_runs
from vigil.studies.study_file import read_study

EXAMPLES = Path(__file__).parents[2] / "examples"
GOOD = """name: mine
settings: {pack: starter, limit: 8}
conditions:
  baseline:
  feedback: {profile: action_feedback, limit: 4}
models:
  - name: One
    agent: random
    repeats: 2
  - name: GPT-5.4
    model: openai/gpt-5.4
    conditions: [baseline]
    settings: {thinking: on, limit: 2, extra-body: {top_k: 20}}
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "s.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def runs_of(tmp_path: Path, text: str = GOOD) -> list[PlannedRun]:
    return planned_runs(read_study(written(tmp_path, text)))


def test_runs_have_settings_roles_and_folders(tmp_path: Path) -> None:
    runs = runs_of(tmp_path)
    assert [(run.label.name, run.label.role) for run in runs] == [
        ("One", "main"),
        ("One [repeat 2]", "repeat"),
        ("One [feedback]", "condition"),
        ("GPT-5.4", "main"),
    ]
    assert [str(run.folder) for run in runs[:2]] == ["runs/mine/runs/One/baseline", "runs/mine/runs/One/baseline-2"]
    assert [run.settings.limit for run in runs] == [8, 8, 4, 2]
    assert runs[2].settings.profile == "action_feedback"
    assert (runs[3].settings.thinking, runs[3].settings.extra_body) == ("on", {"top_k": 20})
    assert [run.label.published for run in runs] == [None, None, None, "GPT-5.4"]
    assert len(labels_of(runs)) == 4


def test_the_main_run_may_be_under_another_condition(tmp_path: Path) -> None:
    runs = runs_of(tmp_path, GOOD.replace("repeats: 2", "main: feedback"))
    assert [(run.label.name, run.label.role) for run in runs[:2]] == [("One", "main"), ("One [baseline]", "condition")]


def test_runs_are_selected_by_name(tmp_path: Path) -> None:
    runs = runs_of(tmp_path)
    assert [run.label.name for run in selected_runs(runs, ["One"], ["feedback"])] == ["One [feedback]"]
    with pytest.raises(SettingError, match=r"no model 'GTP-5\.4'\. Did you mean 'GPT-5\.4'"):
        selected_runs(runs, ["GTP-5.4"], [])


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("name: mine", "nam: mine", "line 1, nam: this key does not exist. Did you mean 'name'"),
        ("limit: 8", "limt: 8", "line 2, settings.limt: 'limt' is not a setting of `vigil run`. Did you mean 'limit'"),
        ("limit: 8", "limit: many", "line 2, settings.limit: Input should be a valid integer"),
        ("limit: 4", "limit: 0", "line 7, models[1]: --limit is 0"),
        ("agent: random", "agnet: random", "line 8, models[1].agnet: this key does not exist. Did you mean 'agent'"),
        ("agent: random", "group: Mine", "line 7, models[1]: give exactly one of `model` and `agent`"),
        ("repeats: 2", "repeats: 0", "line 9, models[1].repeats:"),
        ("repeats: 2", "published: GPT-5", "line 9, models[1].published: 'GPT-5' is not a published model"),
        ("repeats: 2", "agent: noop", "line 8, models[1].agent: the key is a duplicate of line 9"),
        ("[baseline]", "[basline]", "line 12, models[2].conditions[1]: 'basline' is not a condition. Did you mean"),
        ("name: GPT-5.4", "name: one", "models[2].name: the name 'one' is also that of models[1]"),
        ("limit: 8}", "limit: 8", "line 3"),
        ("limit: 8}", "limit: *x}", "line 2: aliases"),
        ("limit: 8}", f"limit: {'[' * 5000}", "line 2: values are nested more than 50 levels deep"),
        ("  - name: One\n", "  - \n", "line 8, models[1]: the key `name` is missing"),
    ],
)
def test_a_fault_names_line_and_key(tmp_path: Path, before: str, after: str, words: str) -> None:
    assert before in GOOD
    with pytest.raises(SettingError) as caught:
        runs_of(tmp_path, GOOD.replace(before, after, 1))
    assert words in str(caught.value)


def test_a_file_that_is_absent_or_no_mapping_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="cannot be read"):
        read_study(tmp_path / "none.yaml")
    with pytest.raises(SettingError, match="a study must consist of keys with values"):
        read_study(written(tmp_path, "- a"))
    with pytest.raises(SettingError, match="is empty"):
        read_study(written(tmp_path, "# nothing"))


def test_the_papers_study_has_its_models_and_conditions() -> None:
    runs = planned_runs(read_study(EXAMPLES / "paper_study.yaml"))
    main = [run for run in runs if run.label.role == "main"]
    assert {run.label.model for run in main} == {model.name for model in paper().models}
    assert {run.label.model for run in main if run.label.is_anchor} == {m.name for m in paper().models if m.anchor}
    for table, wanted in (("proprio_minimal", "feedback"), ("prompt_sensitivity", "neutral")):
        published = {row["model"] for row in paper().tables[table]}
        assert {run.label.model for run in runs if run.condition == wanted} == published
    repeated = {run.label.model for run in runs if run.label.role == "repeat"}
    assert repeated == {row["model"] for row in paper().tables["open_repeat_robustness"]}
    assert len(runs) == 78
