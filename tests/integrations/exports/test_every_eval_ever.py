"""Results hold to the two schemas of Every Eval Ever 0.3.0, and say what the run says."""

import hashlib
import json
import re
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from tests.support.published_runs import PUBLISHED, EpisodeScript, Write, good, records_of, small_records
from vigil.errors import SettingError
from vigil.integrations.exports.every_eval_ever.aggregate import METRICS, identity_of, model_info
from vigil.integrations.exports.every_eval_ever.folder import write_results
from vigil.integrations.exports.options import Disclosure, Publisher
from vigil.protocol.actions import Reply, Usage
from vigil.protocol.families import Family
from vigil.protocol.profile import ACTION_FEEDBACK, Profile
from vigil.records.record import EpisodeRecord, RunHeader, Shard, read_header
from vigil.scoring.saved_run import read_run
from vigil.scoring.summary import summarise

SCHEMAS = Path(__file__).parent / "every_eval_ever_schema"
"""As the package has them (MIT)."""
PLACE = re.compile(
    r"data/vigil/Qwen/Qwen3-VL-8B-Instruct/[0-9a-f]{8}-[0-9a-f]{4}-4[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}"
)


def schema(name: str) -> Any:
    return jsonschema.Draft7Validator(json.loads((SCHEMAS / name).read_text(encoding="utf-8")))


RESULTS, SAMPLE = schema("eval.schema.json"), schema("instance_level_eval.schema.json")


def exported(
    out: Path, *runs: Path, said: list[str] | None = None, **publisher: Any
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Exports runs; returns the first one's results and samples, both held against their schemas."""
    tell = [] if said is None else said
    path = write_results(runs, None, out, Publisher(**publisher), tell.extend)[0]
    results = json.loads(path.read_text(encoding="utf-8"))
    lines = (out / results["detailed_evaluation_results"]["file_path"]).read_text(encoding="utf-8").splitlines()
    samples = [json.loads(line) for line in lines]
    RESULTS.validate(results)
    for sample in samples:
        SAMPLE.validate(sample)
    return results, samples


def mixed() -> dict[str, EpisodeRecord]:
    """Records of the small pack with B, FR, NR and IL among them."""

    def courses(family: Family, is_odd: int) -> list[EpisodeScript]:
        if is_odd:
            return [EpisodeScript(family, True, "NR"), EpisodeScript(family, False, "IL")]
        return [good(family), EpisodeScript(family, False, "success")]

    return records_of({family: courses(family, index % 2) for index, family in enumerate(PUBLISHED)})


def test_files_lie_where_the_database_wants_them_and_name_each_other(write: Write, tmp_path: Path) -> None:
    results, samples = exported(tmp_path / "out", write("a"))
    detail = results["detailed_evaluation_results"]
    files = {str(path.relative_to(tmp_path / "out")) for path in (tmp_path / "out").rglob("*") if path.is_file()}
    stem = detail["file_path"].removesuffix("_samples.jsonl")
    assert PLACE.fullmatch(stem)
    assert files == {f"{stem}.json", f"{stem}_samples.jsonl"}
    content = (tmp_path / "out" / detail["file_path"]).read_bytes()
    assert detail["checksum"] == hashlib.sha256(content).hexdigest()
    assert detail["total_rows"] == len(samples) == 16
    assert {sample["evaluation_id"] for sample in samples} == {results["evaluation_id"]}
    assert {sample["model_id"] for sample in samples} == {results["model_info"]["id"]} == {"Qwen/Qwen3-VL-8B-Instruct"}


def test_every_rate_stands_there_with_its_interval_overall_and_by_family(write: Write, tmp_path: Path) -> None:
    run = write("a", mixed())
    results, samples = exported(tmp_path / "out", run)
    summary = summarise(read_run(run).table.scores())
    found = {each["evaluation_result_id"]: each for each in results["evaluation_results"]}
    assert set(found) == {f"{scope}/{name}" for scope in ("overall", *PUBLISHED) for name in METRICS}
    for result_id, each in found.items():
        scope, _, name = result_id.partition("/")
        rates = summary["overall"] if scope == "overall" else summary["families"][scope]
        told = each["score_details"]
        interval = told["uncertainty"]["confidence_interval"]
        assert told["score"] == rates[name]
        assert [interval["lower"], interval["upper"]] == rates["intervals"][name]
        assert told["uncertainty"]["num_samples"] == rates["episodes"]
        assert each["metric_config"]["lower_is_better"] == (name not in ("W", "B"))
    joined = found[samples[0]["evaluation_result_id"]]
    assert joined["score_details"]["score"] == sum(sample["evaluation"]["score"] for sample in samples) / len(samples)
    assert 0 < joined["score_details"]["score"] < 1


def test_the_settings_of_the_run_stand_there_and_no_address(write: Write, tmp_path: Path) -> None:
    sampling = {"temperature": 0.5, "max_tokens": 512, "seed": 7, "extra_body": {"key": "hush"}}
    run = write("a", sampling=sampling, base_url="http://10.1.2.3:8000/v1")
    results, samples = exported(tmp_path / "out", run, organization="Lab", relationship="third_party")
    config = results["evaluation_results"][0]["generation_config"]
    assert config["generation_args"]["temperature"] == 0.5
    assert config["generation_args"]["max_tokens"] == 512
    assert config["additional_details"]["seed"] == "7"
    assert "Task: " in config["generation_args"]["prompt_template"]
    assert results["source_metadata"]["source_organization_name"] == "Lab"
    assert results["evaluation_results"][0]["source_data"]["additional_details"]["sha256"] == (
        read_header(run).spec.pack_sha256
    )
    everything = f"{results}{samples}"
    assert "hush" not in everything
    assert "10.1.2.3" not in everything
    assert str(tmp_path) not in everything


def test_a_sample_is_the_dialogue_with_its_report_and_tokens(write: Write, tmp_path: Path) -> None:
    records = small_records()
    first, *others = records["AI-000"].steps
    text = "<think>The lamp\u2028is near.</think>{}"
    asked = first.model_copy(update={"reply": Reply(text=text, usage=Usage(input_tokens=9, output_tokens=2))})
    records["AI-000"] = records["AI-000"].model_copy(update={"steps": (asked, *others)})
    _, samples = exported(tmp_path / "out", write("a", records, profile=Profile(name=ACTION_FEEDBACK)))
    sample = next(each for each in samples if each["sample_id"] == "AI-000")
    roles = [message["role"] for message in sample["messages"]]
    assert roles == ["system", *["user", "assistant"] * (len(others) + 1)]
    assert [message["turn_idx"] for message in sample["messages"]] == list(range(len(roles)))
    assert sample["messages"][2]["content"] == "{}"
    assert sample["messages"][2]["reasoning_trace"] == "<think>The lamp\u2028is near.</think>"
    assert "feedback" not in sample["messages"][1]["content"]
    assert "too_far" in sample["messages"][3]["content"]
    assert sample["token_usage"] == {"input_tokens": 9, "output_tokens": 2, "total_tokens": 11}
    (report,) = sample["answer_attribution"]
    assert (report["extracted_value"], report["turn_idx"]) == ("success", len(roles) - 1)
    assert sample["evaluation"] == {
        "score": 1.0,
        "is_correct": True,
        "num_turns": len(others) + 1,
        "tool_calls_count": len(others) + 1,
    }
    raw = sample["input"]["raw"] + "".join(sample["input"]["reference"])
    assert sample["sample_hash"] == hashlib.sha256(raw.encode()).hexdigest()
    assert len({each["sample_hash"] for each in samples}) == len(samples)


@pytest.mark.parametrize("has_key", [False, True], ids=["without", "with"])
def test_the_label_of_a_queried_state_is_told_only_with_the_answer_key(
    write: Write, tmp_path: Path, has_key: bool
) -> None:
    path = write_results(
        [write("a")], None, tmp_path / "out", Publisher(), lambda told: None, Disclosure(answer_key=has_key)
    )[0]
    lines = path.with_name(f"{path.stem}_samples.jsonl").read_text(encoding="utf-8").splitlines()
    for sample in map(json.loads, lines):
        SAMPLE.validate(sample)
        label = (["on"] if has_key else []) if sample["metadata"]["family"] == "SV" else ["success"]
        assert sample["input"]["reference"] == label
        raw = sample["input"]["raw"] + "".join(label)
        assert sample["sample_hash"] == hashlib.sha256(raw.encode()).hexdigest()


def test_nothing_is_attributed_where_no_report_was_made(write: Write, tmp_path: Path) -> None:
    _, samples = exported(tmp_path / "out", write("a", mixed()))
    for sample in samples:
        assert bool(sample["answer_attribution"]) == (sample["metadata"]["end"] == "report")


def test_the_same_run_gives_the_same_files(write: Write, tmp_path: Path) -> None:
    runs = [write("a"), write("b", sampling={"temperature": 1.0})]
    for out in ("one", "two", "two"):
        write_results(runs, None, tmp_path / out, Publisher(), list)
    one, two = ({path.name: path.read_bytes() for path in (tmp_path / out).rglob("*.json*")} for out in ("one", "two"))
    assert one == two
    assert len(one) == 4


@pytest.mark.parametrize("kind", ["privileged", "scripted", "human", "exec"])
def test_who_is_no_model_is_refused(write: Write, tmp_path: Path, kind: Any) -> None:
    run = write("a", agent="solver", kind=kind)
    with pytest.raises(SettingError, match="has only results of models"):
        exported(tmp_path / "out", write("b"), run, force=True)
    assert not (tmp_path / "out").exists()


def test_an_incomplete_run_is_refused_or_says_so(write: Write, tmp_path: Path) -> None:
    records = small_records()
    del records["AI-000"]
    run = write("a", records)
    with pytest.raises(SettingError, match="incomplete: 15 of 16 episodes"):
        exported(tmp_path / "out", run)
    said: list[str] = []
    results, _ = exported(tmp_path / "out", run, said=said, force=True)
    remarks = "INCOMPLETE: 15 of 16 episodes are scored."
    assert results["source_metadata"]["additional_details"]["remarks"] == remarks
    assert said == [f"a: {remarks}"]


def test_a_shard_is_refused_or_says_so(write: Write, tmp_path: Path) -> None:
    whole = small_records()
    names = sorted(read_run(write("whole", shard=Shard(index=1, of=2))).table.rows)
    run = write("a", {name: whole[name] for name, _ in names}, shard=Shard(index=1, of=2))
    with pytest.raises(SettingError, match=r"shard 1/2 of a run. Join the shards with `vigil merge`"):
        exported(tmp_path / "out", run)
    results, _ = exported(tmp_path / "out", run, force=True)
    assert "INCOMPLETE: shard 1/2" in results["source_metadata"]["additional_details"]["remarks"]


def test_a_run_without_a_scored_episode_is_refused(write: Write, tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="nothing to export"):
        exported(tmp_path / "out", write("a", {}), force=True)


def test_a_selection_of_a_pack_says_so(write: Write, tmp_path: Path) -> None:
    some = {name: record for name, record in small_records().items() if name.endswith("000")}
    results, _ = exported(tmp_path / "out", write("a", some, planned=sorted(some)))
    assert (
        results["source_metadata"]["additional_details"]["remarks"] == "A selection: 8 of the 16 episodes of the pack."
    )


def header_of(write: Write, agent: str, base_url: str | None = None) -> RunHeader:
    return read_header(write("a", {}, agent=agent, base_url=base_url))


@pytest.mark.parametrize(
    ("agent", "base_url", "developer", "expected"),
    [
        ("vllm/Qwen/Qwen3-VL", None, None, ("Qwen/Qwen3-VL", "self_deployed", "unknown")),
        ("vllm/mine", None, "Lab", ("Lab/mine", "self_deployed", "unknown")),
        ("vllm//models/mine", None, "Lab", ("Lab/mine", "self_deployed", "unknown")),
        ("openai/gpt-4o", None, None, ("openai/gpt-4o", "externally_managed", "closed_weights")),
        ("openai/azure/gpt-4o", None, None, ("openai/gpt-4o", "externally_managed", "closed_weights")),
        ("openrouter/google/gemma-3:free", None, None, ("google/gemma-3:free", "externally_managed", "open_weights")),
        ("openai/gpt-4o", "http://10.0.0.1/v1", "Lab", ("Lab/gpt-4o", "unknown", "closed_weights")),
        ("local/Lab/mine", "http://10.0.0.1/v1", None, ("Lab/mine", "unknown", "unknown")),
    ],
)
def test_a_model_is_filed_by_its_name(
    write: Write, agent: str, base_url: str | None, developer: str | None, expected: tuple[str, str, str]
) -> None:
    header = header_of(write, agent, base_url)
    identity = identity_of(header, developer)
    details = model_info(header, identity)["additional_details"]
    assert (identity.id, details["deployment_type"], details["model_availability"]) == expected
    assert not any(char in folder for folder in identity.folders for char in "/:")


@pytest.mark.parametrize(
    ("agent", "base_url", "developer"),
    [
        ("vllm/mine", None, None),
        ("openai/mine", "http://10.0.0.1/v1", None),
        ("vllm//models/mine", None, None),
        ("vllm/mine", None, "unknown"),
        ("vllm/mine", None, "a/b"),
        ("vllm/mine", None, ".."),
        ("vllm/mine ", None, "Lab"),
        ("vllm/a*b", None, "Lab"),
    ],
)
def test_a_name_that_cannot_be_filed_is_refused(
    write: Write, agent: str, base_url: str | None, developer: str | None
) -> None:
    with pytest.raises(SettingError, match="--developer"):
        identity_of(header_of(write, agent, base_url), developer)
