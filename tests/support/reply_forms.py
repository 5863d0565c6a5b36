"""Random replies in all forms that models and servers send, from a seeded generator.

Used by tests and by `sweeps/replies.py`: a server's text must be recorded unchanged, and be judged exactly as
`vigil.protocol.replies.parse_text` judges it.
"""

import json
from collections.abc import Callable
from random import Random

from tests.support.wire_server import ModelMessage
from vigil.protocol.actions import ParsedReply, Reply
from vigil.protocol.reasoning import split_reasoning
from vigil.protocol.replies import MAX_REPLY_BYTES, read_reply
from vigil.records.record import StepRecord

ODD = (
    *("\u00e9", "\U0001f600", "\u4f60\u597d", "\u2028", "\u2029", "\ufeff", "\x00", "\x0b", "\x7f", "\u200d", "\u202e"),
    *("\ufffd", "e\u0301", "\U0010ffff", "\\", '"', "\r\n", "\t", "{", "}", "<", "</think", "\u25c1", "data: x\n\n"),
    *("[DONE]", "\ud800", "\udfff", "\ud83d\ude00"),
)
WORDS = ("I", "see", "the", "table", "so", "maybe", "no", "turn", "left", "wait", "<b>", "{hm}", "{}", "[1]", "\n")
MARKERS = (("<think>", "</think>"), ("◁think▷", "◁/think▷"), ('<think budget="9">', "</think>"), ("", "</think>"))


def prose(rng: Random, most: int = 12) -> str:
    words = [rng.choice(ODD[:-3] if rng.random() < 0.15 else WORDS) for _ in range(rng.randint(0, most))]
    return " ".join(words)


def value(rng: Random, depth: int = 0) -> object:
    """Return a random JSON value, such as a thought may be."""
    match rng.randint(0, 7 if depth < 3 else 4):
        case 0:
            return None
        case 1:
            return rng.random() < 0.5
        case 2:
            return rng.choice([0, -1, 10**30, 1e-9, 3.5])
        case 3 | 4:
            return prose(rng) + rng.choice(["", "<think>a</think>", "</think>", "◁/think▷", "```"])
        case 5:
            return [value(rng, depth + 1) for _ in range(rng.randint(0, 3))]
        case _:
            return {prose(rng, 2): value(rng, depth + 1) for _ in range(rng.randint(0, 3))}


def action(rng: Random) -> str:
    """Return a valid action or, with probability 1/6, a malformed one."""
    arguments: dict[str, object] = {"direction": rng.choice(["up", "down"]), "magnitude": rng.choice([1, 5.5, 2.0])}
    skill = "look"
    if rng.random() < 0.4:
        skill = "navigate"
        arguments = {"mode": rng.choice(["turn_left", "turn_right"]), "magnitude": rng.randint(1, 90)}
    if rng.random() < 0.02:
        skill = "report"
        arguments = {"status": rng.choice(["success", "Fail", "done", ""]), "summary": prose(rng)}
    if rng.random() < 0.16:
        name = rng.choice(list(arguments))
        arguments[name] = rng.choice([None, True, "5", -1, 1e999 if rng.random() < 0.1 else 0, [], "forwards"])
    fields: dict[str, object] = {"skill_name": skill, "arguments": arguments}
    for key in ("thought", "cognitive_state", "extra"):
        if rng.random() < 0.3:
            fields[key] = value(rng)
    if rng.random() < 0.3:
        fields = dict(rng.sample(list(fields.items()), len(fields)))
    return json.dumps(fields, ensure_ascii=rng.random() < 0.3, indent=rng.choice([None, None, 1]))


def block(rng: Random, inner: str | None = None) -> str:
    opening, closing = rng.choice(MARKERS)
    return opening + (prose(rng) if inner is None else inner) + closing


def deep(levels: int) -> str:
    return (
        '{"skill_name": "look", "arguments": {"direction": "up", "magnitude": 1}, "thought": '
        + "[" * (levels - 1)
        + "]" * (levels - 1)
        + "}"
    )


def long(rng: Random) -> str:
    """Return an action of the maximum length of a reply, one byte longer, or far too long."""
    text = action(rng)
    size = rng.choice([MAX_REPLY_BYTES, MAX_REPLY_BYTES + 1, 3 * MAX_REPLY_BYTES])
    return text + " " * max(0, size - len(text.encode("utf-8", "surrogatepass")))


def corrupted(rng: Random) -> str:
    text = action(rng)
    match rng.randint(0, 4):
        case 0:
            return text[: rng.randint(0, len(text))]
        case 1:
            place = rng.randint(0, len(text))
            return text[:place] + block(rng) + text[place:]
        case 2:
            place = rng.randint(0, len(text))
            return text[:place] + rng.choice(ODD) + text[place:]
        case 3:
            return text.replace('"', "'")
        case _:
            return text[:-1] + rng.choice([",}", ', "arguments": {}}', ', "thought": NaN}', ', "x": "\\ud800"}', "}}"])


FORMS: dict[str, Callable[[Random], str]] = {
    "plain": action,
    "padded": lambda rng: f"{rng.choice([' ', chr(10), chr(9), chr(160)])}{action(rng)}\r\n ",
    "leading": lambda rng: block(rng) + action(rng),
    "leading, a blank": lambda rng: f"\n{block(rng)}\n\n{action(rng)}\n",
    "two leading": lambda rng: block(rng) + block(rng) + action(rng),
    "nested": lambda rng: block(rng, prose(rng) + block(rng) + prose(rng)) + action(rng),
    "draft": lambda rng: block(rng, action(rng)) + action(rng),
    "draft in prose": lambda rng: block(rng, prose(rng) + action(rng) + prose(rng)) + action(rng),
    "prose, then reasoning": lambda rng: prose(rng) + block(rng) + action(rng),
    "trailing": lambda rng: action(rng) + block(rng),
    "leading and trailing": lambda rng: block(rng) + action(rng) + block(rng),
    "between two": lambda rng: action(rng) + block(rng) + action(rng),
    "between and before": lambda rng: block(rng) + action(rng) + block(rng) + action(rng),
    "unclosed": lambda rng: rng.choice(["<think>", "◁think▷", "<think a=1>"]) + prose(rng) + action(rng),
    "reasoning alone": block,
    "closing alone": lambda rng: action(rng) + rng.choice(["</think>", "◁/think▷"]),
    "fence": lambda rng: f"```json\n{action(rng)}\n```",
    "reasoning and fence": lambda rng: f"{block(rng)}```\n{action(rng)}\n```",
    "prose": prose,
    "prose around": lambda rng: f"{prose(rng)} {action(rng)} {prose(rng)}",
    "two objects": lambda rng: action(rng) + rng.choice(["", "\n", ","]) + action(rng),
    "list": lambda rng: f"[{action(rng)}]",
    "a value": lambda rng: json.dumps(value(rng)),
    "spoilt": corrupted,
    "spoilt, reasoning": lambda rng: block(rng) + corrupted(rng),
    "deep": lambda rng: deep(rng.choice([63, 64, 65, 66, 500, 3000])),
    "deep, reasoning": lambda rng: block(rng) + deep(rng.choice([64, 65])),
    "odd": lambda rng: "".join(rng.choices(ODD, k=rng.randint(0, 9))),
    "empty": lambda rng: rng.choice(["", " ", "\n\n"]),
    "long": long,
}
RARE = {"long": 0.1}


def draw(rng: Random, *, can_refuse: bool = True) -> tuple[str, ModelMessage]:
    """Return the name of a form, and a reply in that form."""
    name = rng.choices(list(FORMS), [RARE.get(form, 1.0) for form in FORMS])[0]
    text = FORMS[name](rng)
    parts = (text,) if text else ()
    if text and rng.random() < 0.2:
        cuts = sorted(rng.randint(0, len(text)) for _ in range(rng.randint(1, 3)))
        parts = tuple(text[a:b] for a, b in zip([0, *cuts], [*cuts, len(text)], strict=True))
    reasoning = rng.choice([action(rng), prose(rng), "<think>x</think>"]) if rng.random() < 0.2 else ""
    refusal = prose(rng) + "I cannot." if can_refuse and rng.random() < 0.15 else None
    if refusal is not None and rng.random() < 0.4:
        parts = ()
    is_cut, is_list, is_null, has_usage = (rng.random() < chance for chance in (0.05, 0.2, 0.5, 0.9))
    return name, ModelMessage(parts, reasoning, refusal, is_cut, is_list, is_null, has_usage)


def mistakes(said: ModelMessage, step: StepRecord, finish_reason: str) -> list[str]:
    """Return the faults in the record of a reply; empty if it has none."""
    text, chars = joined(said.text), reasoning_sent(said)
    sent = Reply.model_validate({"text": text, "finish_reason": finish_reason, "reasoning_chars": chars})
    wanted = read_reply(sent).parsed
    found = []
    if step.reply.reasoning_chars != chars:
        found.append(f"counted {step.reply.reasoning_chars} characters of reasoning, not {chars}")
    if step.reply.cut is not None:
        if not text.encode().startswith(step.reply.raw) or step.reply.cut.text_bytes != len(text.encode()):
            found.append("the part that was kept is not what was sent")
    elif step.reply.raw != text.encode("utf-8", "surrogatepass"):
        found.append(f"kept {step.reply.text!r}")
    if step.reply.reply_source != "server":
        found.append(f"from {step.reply.reply_source}")
    if isinstance(wanted, ParsedReply):
        if (step.action, step.ignored_keys) != (wanted.action, wanted.ignored_keys):
            found.append(f"judged {step.action or step.invalid}, not {wanted.action}")
    elif step.invalid != wanted:
        found.append(f"judged {step.action or step.invalid}, not {wanted}")
    return [f"{one}; sent {text[:300]!r}" for one in found]


def reasoning_sent(said: ModelMessage) -> int:
    """Return the number of characters of reasoning that a server sends: in a separate field, and before the text."""
    return len(joined(said.reasoning)) + split_reasoning(joined(said.text))[1]


def joined(text: str) -> str:
    """Return a text after a round trip through JSON: a pair of escaped surrogates becomes one character."""
    return text.encode("utf-16", "surrogatepass").decode("utf-16", "surrogatepass")
