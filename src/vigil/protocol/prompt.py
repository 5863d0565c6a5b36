"""The prompt: the system text that every agent gets, and the text around each frame.

The system text has four blocks in fixed order, verbatim from the paper; block 2 is made from the tables in
`vigil.protocol.actions`. A custom prompt may use all blocks except the first (`vigil.protocol.prompt_file`). This
module has no access to hidden state. Source: `protocol.md` sections 2.1, 2.4 and 3.
"""

import hashlib
import json
from collections.abc import Sequence
from typing import Literal, NamedTuple

from vigil.protocol.actions import INTENTS, STATUSES, skills_of
from vigil.protocol.claims import CLAIM_LINE, CLAIM_TABLE
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH, Cues, Feedback
from vigil.protocol.profile import Profile
from vigil.protocol.profiles.rows import STOP_LINE, ProfileRow
from vigil.protocol.prompt_file import ACTIONS_SLOT, GROUNDING_SLOT, INSTRUCTION_SLOT, OUTPUT_SLOT
from vigil.protocol.reasoning import split_reasoning

POLICY = "native_embodied_public_evidence"
POLICY_REVISION = 1

ANTI_HALLUCINATION_LINES = (
    "Mere visibility, proximity, or an attempted action is not enough; do not report success from visual "
    "plausibility alone.",
    "Do not claim completion from visual plausibility alone when the task requires changing world state.",
)
TASK_LINES = (
    "You are an embodied agent in a simulated 3D environment with an egocentric (first-person) view.",
    "Each step you only see local observations; plan and act under partial observability.",
    "Ground decisions in the task, the current observation, recent observation history when available, and the "
    "allowed actions schema.",
    "Actions are embodied attempts in the scene, not symbolic shortcuts.",
    "Use only public evidence from this episode. Do not assume hidden simulator state or hidden success signals.",
    "For state-recognition tasks, report the observed state label (for example: on/off or open/closed) rather than "
    "mapping the state to task success/fail.",
    *ANTI_HALLUCINATION_LINES,
    f"Task: {INSTRUCTION_SLOT}",
)
ACTIONS_HEADING = "## Allowed actions"
GROUNDING_HEADING = "## Grounding Rules"
NORMALIZED_RULE = (
    "For interact_pixel, output x and y in normalized_1000 coordinates: integers in [0, 1000], where (0,0) is the "
    "top-left and (1000,1000) is the bottom-right corner."
)
GROUNDING_RULES = (
    "Use only the frame whose `role` is `current` for visibility judgments and interact_pixel targeting.",
    "interact_pixel acts on the object currently under the specified location in the current RGB frame.",
    "Do not assume hidden success state; rely on subsequent public observations and allowed feedback fields from "
    "this episode.",
)
OUTPUT_LINES = (
    "## Output format",
    "Return exactly one JSON object and nothing else.",
    "Required keys: `skill_name`, `arguments`.",
    "Optional keys: `thought`, `cognitive_state`.",
    "Use the exact action names from the allowed-actions schema above; do not invent aliases or synonyms.",
    "Do not output prose, markdown, code fences, or multiple JSON objects.",
    "If you include `thought`, keep it to one short sentence.",
)


class Turn(NamedTuple):
    """A past step in the dialogue history: the JSON that came with its frame (`frame_stub`), and the agent's answer."""

    stub: str
    reply: str


def policy_text(profile: Profile) -> str:
    """Return the system prompt with an empty instruction."""
    blocks = {
        ACTIONS_SLOT: _action_schema(profile.row),
        GROUNDING_SLOT: _grounding_rules(profile),
        OUTPUT_SLOT: "\n".join(OUTPUT_LINES),
    }
    if profile.prompt_template is None:
        return "\n\n".join((_task(profile), *blocks.values()))
    text = profile.prompt_template
    for slot, block in blocks.items():
        text = text.replace(slot, block)
    return text


def system_prompt(instruction: str, profile: Profile) -> str:
    """Return the system prompt of an episode."""
    return policy_text(profile).replace(INSTRUCTION_SLOT, instruction, 1)


def policy_version(profile: Profile) -> str:
    """Return the version string of the prompt. It names the prompt's template family and report vocabulary."""
    own = "" if profile.row.is_papers else f"/{profile.row.short}"
    return f"{POLICY}.v{POLICY_REVISION}/{profile.prompt_variant}/{profile.coordinates}{own}[{','.join(STATUSES)}]"


def policy_sha256(profile: Profile) -> str:
    """Return the SHA-256 of the prompt with an empty instruction slot, and of the profile's other texts."""
    return _sha256("\n\n".join((policy_text(profile), *profile.row.texts)))


def rendered_sha256(instruction: str, profile: Profile) -> str:
    """Return the SHA-256 of the system prompt with the instruction."""
    return _sha256(system_prompt(instruction, profile))


def frame_stub(
    role: Literal["current", "past"], feedback: Feedback | None, cues: Cues | None = None, number: int | None = None
) -> str:
    """Return the JSON that accompanies a frame, including its feedback.

    If `number` is given, it replaces the role, so that the text stays the same when the frame is no longer current.
    """
    size = {"width": FRAME_WIDTH, "height": FRAME_HEIGHT}
    if number is not None:
        stub: dict[str, object] = {"frame": {"number": number, **size}}
    else:
        stub = {"frame": {"role": role, **(size if role == "current" else {})}}
    if feedback is not None:
        stub["feedback"] = {"too_far": feedback.too_far, "path_blocked": feedback.path_blocked}
    if cues is not None:
        stub |= cues.model_dump(exclude_none=True)
    return json.dumps(stub)


def past_turn(
    feedback: Feedback | None, reply_text: str, profile: Profile, cues: Cues | None = None, number: int | None = None
) -> Turn:
    """Return a past step for the dialogue history: its frame stub and the answer.

    An answer that is longer than the history allows is cut.
    """
    answer, _ = split_reasoning(reply_text)
    return Turn(frame_stub("past", feedback, cues, number), answer[: profile.history_reply_chars])


def is_truncated_in_history(answer: str, profile: Profile) -> bool:
    """Return whether an answer is longer than the history allows, and is therefore cut in the history."""
    return len(answer) > profile.history_reply_chars


def recent_turns(turns: Sequence[Turn], profile: Profile) -> list[Turn]:
    """Return the last turns, at most as many as the profile's history allows."""
    return list(turns[max(0, len(turns) - profile.past_turns) :])


def _task(profile: Profile) -> str:
    dropped = ANTI_HALLUCINATION_LINES if profile.prompt_variant == "neutral_report" else ()
    replaced = dict(profile.row.replaced)
    return "\n".join(replaced.get(line, line) for line in TASK_LINES if line not in dropped)


def _action_schema(row: ProfileRow) -> str:
    skills = skills_of(has_report=row.has_report, has_pixels=row.has_pixels)
    wanted = "x, y" if row.has_pixels else "object"
    lines = [ACTIONS_HEADING, f"- {' | '.join(skills)}"]
    for skill, arguments in skills.items():
        lines.append(f"{skill}:")
        for each in arguments:
            need = "required unless intent is drop" if each.unless_drop else "required"
            lines.append(f"- {each.name} ({each.type}, {need}): {each.description}")
        lines += [] if arguments else [STOP_LINE]
    lines += [CLAIM_LINE] if row.has_claims else []
    lines.append("Table intents:")
    for intent, spec in INTENTS.items():
        lines.append(f"- {intent}: {spec.semantics} ({'requires' if spec.needs_pixel else 'no'} {wanted})")
    if row.has_report:
        lines.append("Table report_statuses:")
        lines += [f"- {status}: {semantics}" for status, semantics in STATUSES.items()]
    lines += CLAIM_TABLE if row.has_claims else ()
    return "\n".join(lines)


def _grounding_rules(profile: Profile) -> str:
    row, (first, *others) = profile.row, GROUNDING_RULES
    replaced = dict(row.replaced)
    rules = (row.first_rule or replaced.get(first, first), *(replaced.get(rule, rule) for rule in others), *row.rules)
    if profile.coordinates == "normalized_1000" and row.has_pixels:
        rules = (NORMALIZED_RULE, *rules)
    return "\n".join([GROUNDING_HEADING, *(f"- {rule}" for rule in rules)])


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
