"""Forms of replies: texts that an agent might send, from well-formed to hostile, with what is known of some of them."""

import json
import random
import string
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from vigil.protocol.actions import INTENT_ALIASES, INTENTS, SKILLS, STATUSES, Argument, SkillName
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH

BLANKS = " \t\r\n"
LIMIT_BYTES = 64 * 1024
LEVELS = 64
MARKERS = (("<think>", "</think>"), ("◁think▷", "◁/think▷"))
ODD_NUMBERS = (
    "0", "-0", "0.0", "1e0", "1E+2", "320.0", "3.2e2", "479.99999999999999", "640", "-1", "1e-400", "5e-324", "1e308",
    "1e400", "-1e400", "NaN", "Infinity", "-Infinity", "01", "+1", "1.", ".5", "0x10", "1_000", "true", "null", '"3"',
    "1" * 299, "9" * 301, "1" * 5000, "0." + "0" * 400 + "1", "1e" + "9" * 30, "[1]", "{}", "٣",
)  # fmt: skip
STRANGE = (
    "\x00", "\u00a0", "\u2028", "\ufeff", "\u200b", "\u202e", "\u0130", "ﬀ", "ß", "\U0001f916", "\ud800", "\udfff",
    "\\ud800", "\\udc00", "\\u0000", "\\", '"', "'", "`", "{", "}", "[", "]", ",", ":", "\x1f", "\x7f", "é", "e\u0301",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class ReplyForm:
    """A reply's text. At most one of `same_as` and `is_refused` is set."""

    text: str | bytes
    same_as: str | None = None
    """Text of an object to which the reply is equivalent."""
    is_refused: bool = False
    """Whether the reply is a protocol failure under the strict policy."""
    is_action: bool = False
    """Whether the reply is accepted, when `same_as` is set."""


def any_form(rng: random.Random) -> ReplyForm:
    """Return a reply of any kind."""
    return rng.choices(_MAKERS, _WEIGHTS)[0](rng)


def action_text(rng: random.Random) -> str:
    """Return an object that is an action by the protocol, in one of its many spellings."""
    skill = rng.choice(list(SKILLS))
    fields: dict[str, Any] = {"skill_name": _spelled(rng, skill), "arguments": _arguments(rng, skill)}
    if rng.random() < 0.4:
        fields["thought"] = any_value(rng, 3)
    if rng.random() < 0.3:
        fields["cognitive_state"] = any_value(rng, 3)
    if rng.random() < 0.1:
        fields[word(rng)] = any_value(rng, 2)
    return dumped(rng, fields)


def any_value(rng: random.Random, depth: int) -> Any:
    """Return a JSON value without NaN and lone surrogates."""
    kind = rng.randrange(8 if depth else 6)
    if kind == 6:
        return [any_value(rng, depth - 1) for _ in range(rng.randrange(4))]
    if kind == 7:
        return {word(rng) + str(index): any_value(rng, depth - 1) for index in range(rng.randrange(4))}
    plain = (None, rng.random() < 0.5, rng.randrange(-1000, 1000), rng.uniform(-1e3, 1e3), word(rng), sentence(rng))
    return plain[kind]


def word(rng: random.Random) -> str:
    """Return a few letters, rarely unusual ones that UTF-8 can encode."""
    if rng.random() < 0.1:
        return rng.choice(["", "</think>", "<think>", "```", "é", "\U0001f916", "{", "}", '"', "\\", "\u2028"])
    return "".join(rng.choices(string.ascii_letters, k=rng.randrange(1, 9)))


def sentence(rng: random.Random) -> str:
    """Return some words."""
    return " ".join(word(rng) for _ in range(rng.randrange(1, 12)))


def dumped(rng: random.Random, value: Any) -> str:
    """Return a value as JSON, spaced and escaped in one of several ways."""
    indent = rng.choice([None, None, None, 0, 2, "\t"])
    separators = rng.choice([None, (",", ":"), (" ,\n", " : ")])
    return json.dumps(value, indent=indent, separators=separators, ensure_ascii=rng.random() < 0.5)


def _arguments(rng: random.Random, skill: SkillName) -> dict[str, Any]:
    given = {argument.name: _fitting(rng, argument) for argument in SKILLS[skill]}
    if given.get("intent") == "drop" and rng.random() < 0.5:
        del given["x"], given["y"]
    names = list(given)
    rng.shuffle(names)
    return {name: _spelled(rng, given[name]) if name != "summary" else given[name] for name in names}


def _fitting(rng: random.Random, argument: Argument) -> Any:
    if argument.name == "intent":
        return rng.choice([*INTENTS, *INTENT_ALIASES])
    if argument.name == "status":
        return rng.choice(list(STATUSES))
    if argument.type == "enum":
        return rng.choice(argument.values)
    if argument.type == "int":
        value = rng.randrange(FRAME_WIDTH if argument.name == "x" else FRAME_HEIGHT)
        return float(value) if rng.random() < 0.1 else value
    if argument.type == "number":
        return rng.choice([1, 2, 0.25, 90, 1e-9, 5e-324, 40, 360, 1e308, 10**299, rng.uniform(0.001, 400.0)])
    return sentence(rng)


def _spelled(rng: random.Random, value: Any) -> Any:
    """Return a word of a vocabulary in another case or with blanks around it, sometimes."""
    if not isinstance(value, str) or rng.random() < 0.8:
        return value
    return rng.choice([value.upper(), value.title(), f" {value}\n"])


# --- makers, each a kind of reply -------------------------------------------------------------------------------------


def _plain(rng: random.Random) -> ReplyForm:
    text = action_text(rng)
    padded = _blanks(rng) + text + _blanks(rng)
    return ReplyForm(padded.encode() if rng.random() < 0.2 else padded, same_as=text, is_action=True)


def _reasoned(rng: random.Random) -> ReplyForm:
    """Reasoning at the head is no part of the answer, whether or not its opening marker is there."""
    text = action_text(rng)
    return ReplyForm(_head(rng) + _blanks(rng) + text + _blanks(rng), same_as=text, is_action=True)


def _head(rng: random.Random) -> str:
    blocks: list[str] = []
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        opening, closing = rng.choice(MARKERS)
        kind = rng.randrange(6)
        inner = rng.choice(
            [sentence(rng), action_text(rng), "", "{", "```json\n", f"{opening}{sentence(rng)}{closing}"]
        )
        opening = "" if kind == 0 else f"{opening[:-1]} a='b'{opening[-1]}" if kind == 1 else opening
        blocks.append(_blanks(rng) + opening + inner + closing)
    return "".join(blocks)


def _trailed(rng: random.Random) -> ReplyForm:
    """Anything but white space after the object is text around it."""
    opening, closing = rng.choice(MARKERS)
    tail = rng.choice(
        [sentence(rng) or ".", f"{opening}{word(rng)}{closing}", opening, closing, action_text(rng), "```"]
    )
    if not tail.strip():
        tail = "."
    head = _head(rng) if rng.random() < 0.3 else ""
    return ReplyForm(head + action_text(rng) + _blanks(rng) + tail, is_refused=True)


def _split(rng: random.Random) -> ReplyForm:
    """Reasoning inside of the object is no white space."""
    text = '{"skill_name": "look", "arguments": {"direction": "up", "magnitude": 5}}'
    places = [index for index, char in enumerate(text) if char in ":,{}" and index not in (0, len(text) - 1)]
    place = rng.choice(places) + 1
    opening, closing = rng.choice(MARKERS)
    return ReplyForm(f"{text[:place]}{opening}{word(rng)}{closing}{text[place:]}", is_refused=True)


def _fenced(rng: random.Random) -> ReplyForm:
    lead, trail = rng.choice(["", sentence(rng) + "\n"]), rng.choice(["", "\n" + sentence(rng)])
    return ReplyForm(
        f"{lead}```{rng.choice(['json', '', 'JSON', 'python'])}\n{action_text(rng)}\n```{trail}", is_refused=True
    )


def _wordy(rng: random.Random) -> ReplyForm:
    return ReplyForm(
        rng.choice(["Sure: ", "I will ", "1. ", "-", "\ufeff", "\u200b"]) + action_text(rng), is_refused=True
    )


def _several(rng: random.Random) -> ReplyForm:
    objects = [action_text(rng) for _ in range(rng.randrange(2, 5))]
    joined = rng.choice(["", "\n", ",", " and "]).join(objects)
    return ReplyForm(f"[{joined}]" if rng.random() < 0.3 else joined, is_refused=True)


def _doubled(rng: random.Random) -> ReplyForm:
    name = rng.choice(["skill_name", "arguments", "thought", "x"])
    pair = f'"{name}": {rng.choice(["1", "null", json.dumps(word(rng))])}'
    return ReplyForm(f'{{"skill_name": "look", "arguments": {{}}, {pair}, {pair}}}', is_refused=True)


def _deep(rng: random.Random) -> ReplyForm:
    """At most 64 levels, the outermost object being the first."""
    levels = rng.choice([2, 63, 64, 65, 66, 100, 900, 1100, 5000, rng.randrange(2, 130)])
    inner = levels - 1
    kind = rng.randrange(3)
    if kind == 0:
        nested = "[" * inner + "]" * inner
    elif kind == 1:
        nested = '{"a":' * (inner - 1) + "{}" + "}" * (inner - 1)
    else:
        nested = '[{"a":' * (inner // 2) + ("[]" if inner % 2 else "1") + "}]" * (inner // 2)
    text = f'{{"skill_name": "look", "arguments": {{"direction": "up", "magnitude": 1}}, "thought": {nested}}}'
    if levels > LEVELS:
        return ReplyForm(text, is_refused=True)
    return ReplyForm(text, same_as=text, is_action=True)


def _flat_brackets(rng: random.Random) -> ReplyForm:
    """Brackets inside of a string are no levels."""
    thought = json.dumps(rng.choice("[{") * rng.randrange(1, 3000))
    text = f'{{"skill_name": "look", "arguments": {{"direction": "up", "magnitude": 1}}, "thought": {thought}}}'
    return ReplyForm(text, same_as=text, is_action=True)


def _long(rng: random.Random) -> ReplyForm:
    """64 kB of everything but the reasoning, white space included."""
    size = LIMIT_BYTES + rng.choice([-1, 0, 1, 2, 100, 70_000, -rng.randrange(1, 60_000)])
    base = '{"skill_name": "report", "arguments": {"status": "success", "summary": ""}, "thought": "%s"}'
    kind = rng.randrange(4)
    filler = size - len(base) + 2
    if kind == 0:
        text = base % ("x" * filler)
    elif kind == 1:
        text = base % ("é" * (filler // 2) + "x" * (filler % 2))
    elif kind == 2:
        text = " " * (filler // 2) + base % "" + "\n" * (filler - filler // 2)
    else:
        text = "<think>" + "y" * rng.randrange(200_000) + "</think>" + " " * filler + base % ""
    bare = text.rpartition("</think>")[2].strip(BLANKS)
    return ReplyForm(text, is_refused=True) if size > LIMIT_BYTES else ReplyForm(text, same_as=bare, is_action=True)


def _ill_fitting(rng: random.Random) -> ReplyForm:
    """A JSON object, of which nothing but its being one is known."""
    fields: dict[str, Any] = {"skill_name": rng.choice([*SKILLS, word(rng), 3, None]), "arguments": any_value(rng, 2)}
    if rng.random() < 0.7:
        skill = rng.choice(list(SKILLS))
        fields["skill_name"], fields["arguments"] = skill, _arguments(rng, skill)
        name = rng.choice(list(fields["arguments"]))
        if rng.random() < 0.5:
            fields["arguments"][name] = any_value(rng, 1)
        else:
            del fields["arguments"][name]
    if rng.random() < 0.1:
        del fields[rng.choice(["skill_name", "arguments"])]
    return ReplyForm(dumped(rng, fields))


def _odd_number(rng: random.Random) -> ReplyForm:
    number = rng.choice(ODD_NUMBERS)
    if rng.random() < 0.5:
        return ReplyForm(f'{{"skill_name": "navigate", "arguments": {{"mode": "forward", "magnitude": {number}}}}}')
    x, y = rng.choice([(number, "5"), ("5", number), (number, number)])
    return ReplyForm(f'{{"skill_name": "interact_pixel", "arguments": {{"intent": "pick", "x": {x}, "y": {y}}}}}')


def _mutated(rng: random.Random) -> ReplyForm:
    form = any_form(rng).text if rng.random() < 0.3 else action_text(rng)
    raw = bytearray(form if isinstance(form, bytes) else form.encode("utf-8", "surrogatepass"))
    for _ in range(rng.choice([1, 1, 2, 3, 8])):
        place = rng.randrange(len(raw) + 1)
        kind = rng.randrange(4)
        if kind == 0:
            raw[place:place] = rng.choice(STRANGE).encode("utf-8", "surrogatepass")
        elif kind == 1:
            del raw[place : place + rng.choice([1, 1, 1, 5, 20])]
        elif kind == 2:
            raw[place : place + 1] = bytes([rng.randrange(256)])
        else:
            raw[place:] = raw[place : place + rng.randrange(30)]
    if rng.random() < 0.5:
        return ReplyForm(bytes(raw))
    return ReplyForm(raw.decode("utf-8", rng.choice(["replace", "surrogateescape", "ignore"])))


def _strange(rng: random.Random) -> ReplyForm:
    pool = [
        *STRANGE,
        *BLANKS,
        *(marker for pair in MARKERS for marker in pair),
        '{"skill_name":',
        '"arguments":{}',
        "```",
    ]
    return ReplyForm("".join(rng.choices(pool, k=rng.randrange(40))))


def _random_bytes(rng: random.Random) -> ReplyForm:
    return ReplyForm(rng.randbytes(rng.choice([0, 1, 10, 100, 1000])))


def _lone_surrogate(rng: random.Random) -> ReplyForm:
    half = rng.choice(["\\ud800", "\\udc00x", "\ud83e", "\\uDBFF\\u0041"])
    place = rng.choice(['{"skill_name": "%s", "arguments": {}}', '{"skill_name": "look", "arguments": {"%s": 1}}'])
    return ReplyForm(place % half, is_refused=True)


def _repeated(rng: random.Random) -> ReplyForm:
    """A short piece many times over: what would show a time that grows with the square of the length."""
    pool = [
        "{",
        "[",
        '"',
        "\\",
        "}",
        "]",
        ":",
        ",",
        "`",
        "<think>",
        "</think>",
        "◁/think▷",
        '{"a":',
        "{}",
        "a",
        " ",
        "1",
    ]
    unit = "".join(rng.choices(pool, k=rng.randrange(1, 4)))
    size = rng.choice([1000, 10_000, LIMIT_BYTES, LIMIT_BYTES, 300_000])
    return ReplyForm(rng.choice(["", "<think>", "{", '{"skill_name": "']) + unit * (size // len(unit)))


def _blanks(rng: random.Random) -> str:
    return "".join(rng.choices(BLANKS, k=rng.choice([0, 0, 1, 3])))


_TABLE: tuple[tuple[Callable[[random.Random], ReplyForm], float], ...] = (
    (_plain, 12), (_reasoned, 14), (_trailed, 8), (_split, 4), (_fenced, 4), (_wordy, 4), (_several, 4), (_doubled, 2),
    (_deep, 3), (_flat_brackets, 1), (_long, 0.5), (_ill_fitting, 10), (_odd_number, 8), (_mutated, 16), (_strange, 8),
    (_random_bytes, 4), (_lone_surrogate, 2), (_repeated, 0.3),
)  # fmt: skip
_MAKERS, _WEIGHTS = [maker for maker, _ in _TABLE], [weight for _, weight in _TABLE]
