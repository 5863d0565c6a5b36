"""`vigil prompt` prints what a model is sent."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.support.tiny_pack import tiny_pack
from vigil.cli import app
from vigil.errors import SettingError
from vigil.protocol.profile import Profile
from vigil.protocol.prompt import policy_sha256, policy_text, rendered_sha256, system_prompt
from vigil.protocol.prompt_file import variant_of

GOLDEN = Path(__file__).parents[1] / "golden"


def printed(*words: str) -> tuple[dict[str, str], str]:
    """Return the messages by role, and the notes."""
    done = CliRunner().invoke(app, ["prompt", *words])
    assert done.exit_code == 0, done.output
    parts = done.stdout.split("--- ")[1:]
    return {part.split(" ---\n")[0]: part.split(" ---\n")[1].rstrip("\n") for part in parts}, done.stderr


@pytest.mark.parametrize("variant", ["default", "neutral_report"])
@pytest.mark.parametrize("coordinates", ["pixel", "normalized_1000"])
def test_without_an_episode_the_policy_is_printed(variant: str, coordinates: str) -> None:
    messages, notes = printed("--prompt-variant", variant, "--coordinates", coordinates)
    golden = (GOLDEN / f"prompt-{variant}-{coordinates}.txt").read_text(encoding="utf-8")
    assert messages["system"] == golden.rstrip("\n")
    profile = Profile.model_validate({"prompt_variant": variant, "coordinates": coordinates})
    assert policy_sha256(profile) in notes


def test_an_episodes_instruction_is_filled_in(tmp_path: Path) -> None:
    pack = tiny_pack(tmp_path / "tiny", 1)
    words = ("--pack", str(pack.folder), "--episode", "tiny-DA-000", "--model", "qwen/qwen3-vl-plus")
    messages, notes = printed(*words, "--profile", "action_feedback")
    profile = Profile(coordinates="normalized_1000")
    instruction = pack.episodes[0].instruction
    assert list(messages) == ["system", "user"]
    assert messages["system"] == system_prompt(instruction, profile)
    stub, picture = messages["user"].splitlines()
    assert json.loads(stub) == {"frame": {"role": "current", "width": 640, "height": 480}}
    assert picture == "[picture: 640 x 480, image/png]"
    assert rendered_sha256(instruction, profile) in notes
    assert "feedback" in notes


def test_a_prompt_file_is_shown_as_a_model_gets_it(tmp_path: Path) -> None:
    file = tmp_path / "mine.txt"
    file.write_text("Do this: <TASK_INSTRUCTION>\n\n<ALLOWED_ACTIONS>\n")
    messages, notes = printed("--prompt-file", str(file))
    template = file.read_text().rstrip("\n")
    profile = Profile(prompt_variant=variant_of(template), prompt_template=template)
    assert messages["system"] == policy_text(profile)
    assert messages["system"].startswith("Do this: <TASK_INSTRUCTION>\n\n## Allowed actions\n")
    assert profile.prompt_variant in notes
    assert policy_sha256(profile) in notes


def test_a_prompt_file_beside_a_variant_of_the_papers_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "mine.txt"
    file.write_text("<TASK_INSTRUCTION>")
    done = CliRunner().invoke(app, ["prompt", "--prompt-file", str(file), "--prompt-variant", "neutral_report"])
    assert isinstance(done.exception, SettingError)
    assert "leave out --prompt-variant or --prompt-file" in str(done.exception)


def test_a_profile_that_is_not_there_is_refused() -> None:
    done = CliRunner().invoke(app, ["prompt", "--profile", "basline"])
    assert isinstance(done.exception, SettingError)
