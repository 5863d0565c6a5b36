"""The forms in which servers send reasoning, as the table in docs/models.md names them."""

from typing import Any, NamedTuple

from wire_server import Said

from vigil.record import StepRecord

REPORT = '{"skill_name": "report", "arguments": {"status": "success", "summary": ""}}'
DRAFT = '{"skill_name": "look", "arguments": {"direction": "up", "magnitude": 5}}'
THOUGHT = f"I could answer {DRAFT}, but the table is near."


class Form(NamedTuple):
    """Something said in a form, and what is to become of it."""

    said: Said
    reason: str | None = None
    """None when the reply is the report."""
    detail: str = ""


def text(*parts: str, **more: Any) -> Said:
    return Said(parts, **more)


REASONING_FORMS: dict[str, Form] = {
    "`reasoning_content`": Form(text(REPORT, reasoning=THOUGHT)),
    "`reasoning`": Form(text(REPORT, reasoning=THOUGHT, reasoning_field="reasoning")),
    "`reasoning_details`": Form(text(REPORT, reasoning=THOUGHT, reasoning_field="reasoning_details")),
    "parts of the content": Form(text(REPORT, reasoning=THOUGHT, reasoning_field="content")),
    "`<think>...</think>`": Form(text(f"<think>\n{THOUGHT}\n</think>\n\n{REPORT}")),
    "`</think>` alone": Form(text(f"{THOUGHT}\n</think>\n\n{REPORT}")),
    "`◁think▷...◁/think▷`": Form(text(f"◁think▷{THOUGHT}◁/think▷{REPORT}")),
    "several blocks": Form(text(f"<think>{THOUGHT}</think>\n<think>{THOUGHT}</think>{REPORT}")),
    "a block that is not closed": Form(text(f"<think>{THOUGHT}"), "unclosed_reasoning"),
    "a block cut by the token limit": Form(text(f"<think>{THOUGHT}", is_cut=True), "truncated", "unclosed_reasoning"),
    "only reasoning, apart": Form(
        text(reasoning=THOUGHT, is_null=True),
        "empty",
        f"all {len(THOUGHT)} characters came as reasoning, and no answer followed",
    ),
    "only reasoning, apart, cut": Form(
        text(reasoning=THOUGHT, is_null=True, is_cut=True),
        "truncated",
        f"empty all {len(THOUGHT)} characters came as reasoning, and no answer followed",
    ),
}


def check_judged(name: str, step: StepRecord) -> None:
    """Asserts that a step in which a form was said is judged as the protocol says."""
    form = REASONING_FORMS[name]
    if form.reason is None:
        assert step.invalid is None, name
        assert step.action.skill_name == "report"
        assert step.reply.reasoning_chars >= len(THOUGHT)
        assert step.reply.text == form.said.text
    else:
        assert (step.invalid.kind, step.invalid.reason) == ("protocol_failure", form.reason), name
        assert step.invalid.detail.startswith(form.detail)
        assert step.reply.finish_reason == ("length" if form.said.is_cut else "stop")
