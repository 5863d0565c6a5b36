"""Processors whose chat template makes a trainer's conversation the one that `vigil run` sends to the same model.

TRL lets a model continue only after a call of a tool, and shows it the answer as the message of a tool. Here a reply is
a call, and the answer of the tool is a message of the user.
"""

import re
from typing import Any

from vigil.errors import SettingError

_REWRITTEN = """\
{%- set ns = namespace(seen=[]) -%}
{%- for message in messages -%}
{%- set calls = message.tool_calls -%}
{%- if message.role == 'tool' -%}
{%- set ns.seen = ns.seen + [{'role': 'user', 'content': message.content}] -%}
{%- elif calls -%}
{%- set call = calls[0].function -%}
{%- set said = call.arguments.text | default('') if call.name == 'reply' else call | tojson -%}
{%- set ns.seen = ns.seen + [{'role': 'assistant', 'content': [{'type': 'text', 'text': said}]}] -%}
{%- else -%}
{%- set ns.seen = ns.seen + [message] -%}
{%- endif -%}
{%- endfor -%}
{%- set messages = ns.seen -%}
{%- set tools = none -%}
"""
"""Beginning of a chat template: replies are text, answers of tools are messages of the user, no tools are listed."""
_REPORT = r'(?=[\s\S]*"skill_name"\s*:\s*"report")'
"""Pattern of the place before a report."""


def protocol_processor(processor: Any) -> Any:
    """Return the processor of a vision-language model, changed for `Episodes(actions="text")`.

    Its chat template and response template are changed in place. A reply becomes a call of the tool `reply`; a report
    does not, so that it ends the conversation. Raises SettingError if the processor does not have a chat template.
    """
    template = processor.chat_template
    if not isinstance(template, str):
        raise SettingError("The processor has no chat template: take that of an instruction-tuned model.")
    if template.startswith(_REWRITTEN):
        return processor
    processor.chat_template = _REWRITTEN + template
    user = [{"role": "user", "content": [{"type": "text", "text": ""}]}]
    asked, opened = (processor.apply_chat_template(user, add_generation_prompt=more) for more in (False, True))
    end = re.escape(processor.tokenizer.eos_token)
    processor.tokenizer.response_template = {
        "defaults": {"role": "assistant"},
        "start_anchor": opened.removeprefix(asked),
        "fields": {
            "content": {"open_pattern": _REPORT, "close_pattern": rf"{end}\s*", "content": "text"},
            "tool_calls": {
                "close_pattern": rf"{end}\s*",
                "repeats": True,
                "content": "text",
                "transform": {
                    "type": "function",
                    "function": {"name": "reply", "arguments": {"text": "{content}"}},
                },
            },
        },
    }
    return processor
