"""What to do about a server's refusals that are no matter of name and key, told by the words of the refusal."""

import re

HINTS: tuple[tuple[str, str], ...] = (
    (
        r"(images?|vision|multimodal)\b.{0,40}(not supported|unsupported|not allowed|only supported by certain)|"
        r"(not|n.t) (support|accept|take)s?\b.{0,40}(image|vision|multimodal)|not a multimodal|only supports? text|"
        r"support image input|unknown variant `image_url`|at most 0 image|mmproj|should be 'text'|text.only (model|input)|"
        r"content must be a string|content should be a valid string",
        "The model, or its server, takes no pictures. Name a model that sees, or start the server with what makes it "
        "see (llama.cpp: --mmproj FILE; vLLM and SGLang: a checkpoint with vision)",
    ),
    (
        r"only supports? stream|stream.{0,40}(must|should|has to|needs to) be (set to )?true|only.{0,20}streaming|"
        r"(only|just).{0,20}stream(ing)? (mode|output|response|call)|non-?stream.{0,60}(not|n.t|unsupported)|"
        r"set to false for non-?stream|仅支持流",
        "The server only streams: add --extra-body '{\"stream\": true}'",
    ),
    (
        r"system.?role|roles must alternate|only user.{0,20}assistant.{0,20}roles|unknown variant `system`|"
        r"(not|n.t) support.{0,20}['\"`]?system['\"`]?( message| role| prompt| with|\b)|"
        r"system (message|prompt|instruction)s?.{0,30}(not|n.t|unsupported)|developer instruction is not enabled",
        "The model's chat template knows no system role: add --system-role user",
    ),
    (
        r"unexpected endpoint or method|no (such )?route|cannot post /",
        "The address may lack its end: most servers are asked at http://HOST:PORT/v1",
    ),
    (
        r"max_tokens.{0,80}max_completion_tokens",
        "Leave out --max-tokens and give --extra-body '{\"max_completion_tokens\": N}'",
    ),
)
"""The words of a refusal, and what to do. The first that fit count."""


def hint_for(message: str) -> str | None:
    """Returns what to do about a refusal, as a sentence without its full stop; None where its words do not tell."""
    return next((hint for words, hint in HINTS if re.search(words, message, re.IGNORECASE | re.DOTALL)), None)
