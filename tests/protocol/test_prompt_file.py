"""Prompt files: what becomes of their text and placeholders, and which are refused, by line."""

from pathlib import Path

import pytest
from pydantic import ValidationError

from vigil.errors import SettingError
from vigil.protocol.profile import Profile
from vigil.protocol.prompt import policy_sha256, policy_text, policy_version, system_prompt
from vigil.protocol.prompt_file import MAX_BYTES, read_prompt_file, variant_of

WHOLE = "Be brief.\nTask: <TASK_INSTRUCTION>\n\n<ALLOWED_ACTIONS>\n\n<GROUNDING_RULES>\n\n<OUTPUT_FORMAT>"


def own(template: str, **more: str) -> Profile:
    fields = {"prompt_variant": variant_of(template), "prompt_template": template, **more}
    return Profile.model_validate(fields)


@pytest.mark.parametrize("coordinates", ["pixel", "normalized_1000"])
def test_the_blocks_are_those_of_the_papers_prompt(coordinates: str) -> None:
    paper = Profile.model_validate({"coordinates": coordinates})
    ours = system_prompt("Open it.", own(WHOLE, coordinates=coordinates))
    assert ours.split("\n\n")[0] == "Be brief.\nTask: Open it."
    assert ours.split("\n\n")[1:] == system_prompt("Open it.", paper).split("\n\n")[1:]


def test_a_file_may_leave_the_blocks_out_and_says_then_nothing_of_its_own() -> None:
    assert system_prompt("Open <ALLOWED_ACTIONS>.", own("<TASK_INSTRUCTION>")) == "Open <ALLOWED_ACTIONS>."


def test_another_text_is_another_variant() -> None:
    one, other = own(WHOLE), own(f"{WHOLE} ")
    assert one.prompt_variant.startswith("file-")
    assert len({each.prompt_variant for each in (one, other, Profile())}) == 3
    assert len({policy_sha256(each) for each in (one, other, Profile())}) == 3
    assert f"/{one.prompt_variant}/pixel" in policy_version(one)


def test_the_papers_text_in_a_file_is_no_variant_of_the_papers() -> None:
    text = policy_text(Profile())
    assert policy_text(own(text)) == text
    assert own(text).prompt_variant != "default"


@pytest.mark.parametrize(
    "fields",
    [
        {"prompt_template": WHOLE},
        {"prompt_variant": variant_of(WHOLE)},
        {"prompt_variant": variant_of(WHOLE), "prompt_template": f"{WHOLE} "},
        {"prompt_variant": "neutral_report", "prompt_template": WHOLE},
        {"prompt_variant": variant_of("x"), "prompt_template": "x"},
    ],
)
def test_a_profile_whose_variant_is_not_its_texts_is_refused(fields: dict[str, str]) -> None:
    with pytest.raises(ValidationError, match=r"prompt_variant|TASK_INSTRUCTION"):
        Profile.model_validate(fields)


def test_line_ends_and_byte_order_marks_do_not_make_another_variant(tmp_path: Path) -> None:
    file = tmp_path / "p.txt"
    for data in (WHOLE.encode(), f"{WHOLE}\n".encode(), b"\xef\xbb\xbf" + WHOLE.replace("\n", "\r\n").encode()):
        file.write_bytes(data)
        assert read_prompt_file(str(file)) == WHOLE


@pytest.mark.parametrize(
    ("data", "named"),
    [
        (b"", "<TASK_INSTRUCTION> is missing"),
        (b"Do it.", "<TASK_INSTRUCTION> is missing"),
        (b"<TASK_INSTRUCTION>\n\n<TASK_INSTRUCTION>", "line 3: <TASK_INSTRUCTION> occurs twice"),
        (b"<TASK_INSTRUCTION>\n<GROUNDING_RULE>", "line 2: .* Did you mean '<GROUNDING_RULES>'"),
        (b"<TASK_INSTRUCTION>\n<TARGET_ID>", "line 2: <TARGET_ID> is not a placeholder"),
        (b"<TASK_INSTRUCTION>\n\xff", "line 2 is not UTF-8"),
        (b"<TASK_INSTRUCTION>\n\n\x00", "line 3: .* is not allowed in a text"),
        (b"<TASK_INSTRUCTION>" + b"x" * MAX_BYTES, "64,018 bytes are too many"),
    ],
)
def test_a_bad_file_is_refused_by_name_and_line(tmp_path: Path, data: bytes, named: str) -> None:
    file = tmp_path / "mine.txt"
    file.write_bytes(data)
    with pytest.raises(SettingError, match=rf"mine\.txt': {named}"):
        read_prompt_file(str(file))


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "none.txt"):
        with pytest.raises(SettingError, match="does not exist, or is not a file"):
            read_prompt_file(str(path))
