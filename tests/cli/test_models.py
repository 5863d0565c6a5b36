"""`vigil models`, and the commands of the paper's models."""

import base64
import io
import json
import os
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from tests.support.inspect_marks import INSPECT
from tests.support.wire_server import ModelMessage, WireServer
from vigil.analysis.measures.paper import paper
from vigil.cli import app
from vigil.cli.models import LISTED
from vigil.errors import SettingError
from vigil.protocol.profile import COORDINATES_BY_MODEL, known_coordinates
from vigil.runner.models.providers import PROVIDERS, parse_model_name

pytestmark = INSPECT
PAGE = (Path(__file__).parents[2] / "docs" / "models.md").read_text(encoding="utf-8")
COMMANDS: dict[str, str] = {
    name: words for words, name in re.findall(r"^vigil (run --model .*?) +# (.+)$", PAGE, re.MULTILINE)
}


@pytest.fixture(autouse=True)
def _no_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in list(os.environ):
        if name.endswith(("_API_KEY", "_BASE_URL", "_TOKEN")):
            monkeypatch.delenv(name)


def test_every_model_of_the_paper_has_a_command() -> None:
    assert sorted(COMMANDS) == sorted(model.name for model in paper().models)
    assert len(COMMANDS) == 28


def test_the_page_names_the_papers_models_without_coordinates() -> None:
    unknown = {name for name, command in COMMANDS.items() if known_coordinates(shlex.split(command)[2]) is None}
    assert unknown == {"Kimi-VL-A3B (T)", "Kimi-VL-A3B-Instruct"}
    assert "Of the paper's models, only Kimi-VL does not have a row" in " ".join(PAGE.split())


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_of_the_papers_models_passes_the_dry_run(name: str) -> None:
    words = shlex.split(COMMANDS[name])
    done = CliRunner().invoke(app, [*words, "--limit", "1", "--dry-run"])
    assert done.exit_code == 0, done.output
    model = parse_model_name(words[2])
    assert f"Model: {model.name!r} at " in done.output
    if model.provider.needs_key:
        assert f"export {model.provider.keys[0]}=" in done.output
        assert f"`{model.provider.keys[0]}`" in PAGE
    if model.provider.extra:
        assert f"the extra `{model.provider.extra}`" in PAGE


def test_a_dry_run_refuses_a_provider_that_is_not_known() -> None:
    done = CliRunner().invoke(app, ["run", "--model", "dubao/seed", "--dry-run"])
    assert isinstance(done.exception, SettingError)
    assert "Did you mean 'doubao'?" in str(done.exception)


def test_keys_are_told_to_be_set_and_never_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ARK_API_KEY", "a-very-secret-word")
    monkeypatch.setenv("ZHIPUAI_API_KEY", "a-very-secret-word")
    for words in ([], ["--json"], ["--model", "doubao/m"], ["--model", "doubao/m", "--json"]):
        done = CliRunner().invoke(app, ["models", *words])
        assert done.exit_code == 0
        assert "ARK_API_KEY" in done.output
        assert "secret" not in done.output
    rows = json.loads(CliRunner().invoke(app, ["models", "--json"]).output)
    assert rows["doubao"]["key"] == "ARK_API_KEY (set)"
    assert rows["zhipu"]["key"] == "ZHIPUAI_API_KEY (set)"
    assert rows["qwen"]["key"] == "DASHSCOPE_API_KEY (not set)"
    assert rows["vllm"]["key"] == ""


def test_extras_are_told_to_be_installed_or_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vigil.runner.models.providers.find_spec", lambda name: None)
    rows = json.loads(CliRunner().invoke(app, ["models", "--json"]).output)
    assert {name: row["extra"] for name, row in rows.items() if row["extra"]} == {
        name: f"{PROVIDERS[name].extra} (not installed)" for name in LISTED if PROVIDERS[name].extra
    }
    facts = json.loads(CliRunner().invoke(app, ["models", "--model", "google/m", "--json"]).output)
    assert "pip install 'vigil-bench[google]'" in facts["missing"]


def test_one_model_is_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MY_KEY", "chosen-secret")
    words = ["--model", "qwen/qwen3-vl-plus", "--base-url", "http://localhost:1/v1", "--api-key-env", "MY_KEY"]
    facts = json.loads(CliRunner().invoke(app, ["models", *words, "--json"]).output)
    assert facts["asked"] == "'qwen3-vl-plus' at http://localhost:1/v1, with the key in MY_KEY"
    assert facts["coordinates"].startswith("normalized_1000 (published table")
    assert facts["thinking off"] == "extra_body.enable_thinking=False"
    refused = CliRunner().invoke(app, ["models", "--base-url", "http://localhost:1/v1"])
    assert "add --model" in str(refused.exception)


@pytest.mark.parametrize("name", [name for name, one in PROVIDERS.items() if one.signs_in])
def test_a_cloud_is_told_with_its_own_name_of_the_model_and_its_accounts_address(
    monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr("vigil.runner.models.providers.find_spec", lambda name: None if "azure" in name else name)
    words = ["models", "--model", f"{name}/some-model", "--json"]
    told = json.loads(CliRunner().invoke(app, words).output)
    assert told["asked"] == "'some-model' at the account's address, signed in with this machine's account"
    assert ("pip install 'vigil-bench[azure]'" in told["missing"]) == (name in ("openai/azure", "azureai"))
    for key in PROVIDERS[name].keys[:1]:
        monkeypatch.setenv(key, "a-key")
        assert json.loads(CliRunner().invoke(app, words).output)["asked"].endswith(f", with the key in {key}")


def test_a_model_that_is_in_no_table_of_coordinates_is_said_to_be_in_none() -> None:
    facts = json.loads(CliRunner().invoke(app, ["models", "--model", "vllm/a-model", "--json"]).output)
    hint = "the table does not name this model; find out with: vigil calibrate --model vllm/a-model"
    assert facts["coordinates"] == f"pixel ({hint})"
    assert hint in CliRunner().invoke(app, ["prompt", "--model", "vllm/a-model"]).output
    for words in (
        ["--model", "qwen/a-model"],
        ["--model", "vllm/Qwen3-VL"],
        ["--model", "m", "--coordinates", "pixel"],
    ):
        assert ("vigil calibrate" in CliRunner().invoke(app, ["prompt", *words]).output) == ("qwen" in words[1])


def test_the_list_ends_with_the_table_of_coordinates() -> None:
    lines = [" ".join(line.split()) for line in CliRunner().invoke(app, ["models"]).output.splitlines()]
    rows = [" ".join(row) for row in COORDINATES_BY_MODEL]
    assert [line for line in lines if line in rows] == rows


@pytest.mark.parametrize(("scale", "said"), [(1000, "points in normalized_1000"), (1, "fractions of 0 to 1")])
def test_a_model_is_calibrated_against_its_server(scale: int, said: str) -> None:
    def brain(wire: str, data: bytes) -> ModelMessage:
        parts = json.loads(data)["messages"][-1]["content"]
        url = next(part["image_url"]["url"] for part in parts if part["type"] == "image_url")
        rgb = np.asarray(Image.open(io.BytesIO(base64.b64decode(url.partition(",")[2]))), dtype=int)
        rows, columns = np.nonzero((rgb[..., 0] > 200) & (rgb[..., 1] < 60))
        return ModelMessage((json.dumps({"x": columns.mean() / 640 * scale, "y": rows.mean() / 480 * scale}),))

    with WireServer(brain) as server:
        words = ["calibrate", "--model", "vllm/some-model", "--base-url", f"{server.url}/v1", "--thinking", "off"]
        done = CliRunner().invoke(app, words)
    assert done.exit_code == (0 if scale == 1000 else 1), done.output
    assert said in done.output
    assert len(server.requests) == done.output.count("spot at") == 8
    assert server.requests[0].body["chat_template_kwargs"]["enable_thinking"] is False
    if scale == 1000:
        assert "--coordinates normalized_1000 (the table does not name this model)" in done.output
