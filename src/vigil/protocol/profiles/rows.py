"""The table of profiles: what each shows an agent and asks of it, beyond the paper's baseline.

A new profile is a row here. Every record has the name of its profile, and a hash of the prompt that also covers the
other texts of the profile. Source: `protocol.md` sections 2.4 and 11.
"""

from dataclasses import dataclass

LOOK_AGAIN = "Your report does not count yet. Look again, then report again to confirm."
CRITERIA_REQUEST = (
    "Before the first step: write what must be visible in the frames before you report, in at most three short "
    "sentences. This answer is plain text, not an action; it stays in the history."
)
STOP_LINES = (
    (
        "For state-recognition tasks, report the observed state label (for example: on/off or open/closed) rather than "
        "mapping the state to task success/fail.",
        "For state-recognition tasks, look at the object whose state is asked for, then stop.",
    ),
    (
        "Mere visibility, proximity, or an attempted action is not enough; do not report success from visual "
        "plausibility alone.",
        "Mere visibility, proximity, or an attempted action is not enough; do not stop from visual plausibility alone.",
    ),
)
"""Pairs: a line of the paper's prompt about reports, and the line that replaces it in a profile without reports."""
NAMING_LINES = (
    (
        "Use only the frame whose `role` is `current` for visibility judgments and interact_pixel targeting.",
        "Use only the frame whose `role` is `current` for visibility judgments and interact_object targeting.",
    ),
    (
        "interact_pixel acts on the object currently under the specified location in the current RGB frame.",
        "interact_object acts on the only object of that name in the current RGB frame. It has no effect if no such "
        "object is seen, or several are.",
    ),
)
"""Pairs: a line of the paper's prompt about pixels, and the line that replaces it in a profile without pixels."""
STOP_LINE = "- no arguments: ends the episode. Nothing else is said about the task, and no step follows."
MAX_IMAGE_HISTORY = 20
EVERYTHING = 1_000_000
"""Number of past turns or pictures that means "all of them"."""


@dataclass(frozen=True, slots=True)
class ProfileRow:
    """What distinguishes a profile from the baseline: what it shows an agent, and what it asks of the agent."""

    short: str
    """Short name of the profile, for the command line."""
    has_feedback: bool = False
    """Whether the agent gets `too_far` and `path_blocked` after each action."""
    looks_again: bool = False
    """Whether the first report, if a step is left, does not end the episode but is answered by `LOOK_AGAIN`."""
    declares_criteria: bool = False
    """Whether a model is asked, before its first action, to write what it must see to report (`CRITERIA_REQUEST`)."""
    shows_remaining_steps: bool = False
    """Whether the agent sees how many replies are left."""
    marks_click: bool = False
    """Whether each frame that follows a click has a mark at the clicked pixel."""
    has_report: bool = True
    """Whether the agent ends an episode by a report; otherwise by `stop`, which says nothing."""
    has_pixels: bool = True
    """Whether the agent interacts with an object by a pixel; if False, it names the object."""
    has_claims: bool = False
    """Whether a report has a claim about each chore of a list."""
    images: int = 0
    """Number of past frames that stay in a model's conversation."""
    is_append_only: bool = False
    """Whether a model's conversation only grows: no past turn is dropped or changed."""
    rules: tuple[str, ...] = ()
    """Rules that the profile adds at the end of the prompt's grounding rules."""
    replaced: tuple[tuple[str, str], ...] = ()
    """Pairs: a line of the prompt's task block or grounding rules, and the line that replaces it."""
    first_rule: str = ""
    """Rule that replaces the paper's first grounding rule; empty if the paper's rule stays."""

    @property
    def name(self) -> str:
        """Full name of the profile, as in records."""
        return f"pure_rgb_dialogue_history_{self.short}"

    @property
    def is_papers(self) -> bool:
        """Whether the profile is one of the two profiles of the paper."""
        return self.short in ("baseline", "action_feedback")

    @property
    def is_of_conversations(self) -> bool:
        """Whether the profile changes a model's conversation, so that programs and scripts cannot use it."""
        return self.declares_criteria or self.images > 0

    @property
    def texts(self) -> tuple[str, ...]:
        """Texts that the agent gets outside of the prompt."""
        return (*([LOOK_AGAIN] if self.looks_again else []), *([CRITERIA_REQUEST] if self.declares_criteria else []))


_ROWS = (
    ProfileRow("baseline"),
    ProfileRow("action_feedback", has_feedback=True),
    ProfileRow("itemised_report", has_claims=True),
    ProfileRow("look_before_report", looks_again=True),
    ProfileRow("declare_criteria", declares_criteria=True),
    ProfileRow(
        "remaining_steps",
        shows_remaining_steps=True,
        rules=("`remaining_steps` next to a frame says how many replies are left, the one to this frame included.",),
    ),
    ProfileRow(
        "grounding_echo",
        marks_click=True,
        rules=(
            "A ring in the current frame marks the pixel of your last action if that was interact_pixel, whether or "
            "not the action had an effect. The ring is not part of the scene.",
        ),
    ),
    ProfileRow("stop_only", has_report=False, replaced=STOP_LINES),
    ProfileRow("named_objects", has_pixels=False, replaced=NAMING_LINES),
    ProfileRow(
        "image_history_all",
        images=EVERYTHING,
        is_append_only=True,
        first_rule="Use only the last frame, the one with the highest `number`, for visibility judgments and "
        "interact_pixel targeting; earlier frames show the scene as it was then.",
    ),
    *(
        ProfileRow(
            f"image_history_{count}",
            images=count,
            rules=(f"Up to {count} past frames are included; they show the scene as it was then.",),
        )
        for count in range(1, MAX_IMAGE_HISTORY + 1)
    ),
)
PROFILES: dict[str, ProfileRow] = {row.name: row for row in _ROWS}
"""Full name of a profile -> its row."""
PROFILE_NAMES: dict[str, str] = {name: row.name for row in _ROWS for name in (row.short, row.name)}
"""Short or full name of a profile -> its full name."""


def unnameable(row: ProfileRow, simulator: str) -> str:
    """Return the message for a profile that names objects, on a simulator that cannot find them by names."""
    return (
        f"Under profile {row.short!r} an agent names objects, and simulator {simulator!r} cannot find objects by their "
        "names. Use the simulator 'mujoco', or another profile."
    )
