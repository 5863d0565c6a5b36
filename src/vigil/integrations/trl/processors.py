"""Processors that turn a trainer's conversation into the messages that `vigil run` sends to the same model.

TRL lets a model continue only after a tool call, and shows it the result as a message of the tool. Here, each reply
becomes a tool call, and the chat template shows the result as a message of the user.
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
"""Start of a chat template. It turns calls of `reply` into text and their results into user messages, and lists no
tools."""
_REPORT = r'(?=[\s\S]*"skill_name"\s*:\s*"report")'
"""Pattern that matches the start of a text that contains a report."""


def protocol_processor(processor: Any) -> Any:
    """Change the processor of a vision-language model for `Episodes(actions="text")`, and return it.

    Its chat template and response template are changed in place. Then a reply is parsed as a call of the tool `reply`,
    and a report as plain text, so that it ends the conversation. Raises SettingError if the processor does not have a
    chat template.
    """
    template = processor.chat_template
    if not isinstance(template, str):
        raise SettingError(
            "The processor does not have a chat template. Use the processor of an instruction-tuned model."
        )
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
