"""Messages that are sent to a vision-language model: the system prompt, a bounded text history and the current frame.

`vigil.runner.models.inspect_model` sends the messages and returns the reply. Source: `protocol.md` section 2.1.
"""

from dataclasses import dataclass, replace
from typing import Literal

from vigil.agents.frame_encoding import EncodedFrame
from vigil.protocol.observation import Cues, Feedback
from vigil.protocol.profile import Profile
from vigil.protocol.profiles.rows import CRITERIA_REQUEST
from vigil.protocol.prompt import Turn, frame_stub, past_turn, recent_turns, system_prompt
from vigil.protocol.reasoning import split_reasoning


@dataclass(frozen=True, slots=True)
class Message:
    """One message of a chat. Only a chat's last message has an image, unless the profile keeps past frames."""

    role: Literal["system", "user", "assistant"]
    text: str
    picture: EncodedFrame | None = None
    question: str | None = None
    """Text that follows the image; None except in the last message of a probe (a question at a recorded step)."""


class Conversation:
    """The messages of one episode. The history has only text, unless the profile keeps past frames."""

    def __init__(self, profile: Profile, instruction: str) -> None:
        self._profile = profile
        self._system = system_prompt(instruction, profile)
        self._opening: list[Message] = []
        self._turns: list[Turn] = []
        self._pictures: list[EncodedFrame | None] = []

    def opening_request(self) -> list[Message]:
        """Return the messages that ask a model to declare its criteria, before the first step."""
        return self._with_system([Message("user", CRITERIA_REQUEST)])

    def declare(self, answer: str) -> None:
        """Add the criteria that the model declared. Every later request sends them before the history."""
        text = split_reasoning(answer)[0][: self._profile.history_reply_chars]
        self._opening = [Message("user", CRITERIA_REQUEST), Message("assistant", text)]

    def messages(self, picture: EncodedFrame, feedback: Feedback | None, cues: Cues | None = None) -> list[Message]:
        """Return all messages of the request for a reply to the current frame."""
        messages = [*self._opening]
        turns = recent_turns(self._turns, self._profile)
        shown = self._pictures[-self._profile.row.images :] if self._profile.row.images else []
        pictures = [*[None] * (len(self._turns) - len(shown)), *shown][len(self._turns) - len(turns) :]
        for turn, past in zip(turns, pictures, strict=True):
            messages += [Message("user", turn.stub, past), Message("assistant", turn.reply)]
        messages.append(Message("user", frame_stub("current", feedback, cues, self._number()), picture))
        return self._with_system(messages)

    def add(
        self,
        feedback: Feedback | None,
        reply: str,
        *,
        cues: Cues | None = None,
        picture: EncodedFrame | None = None,
    ) -> None:
        """Add a finished turn to the history: the JSON that came with its frame, and the raw reply.

        `picture` is the frame, if the profile keeps past frames.
        """
        self._turns.append(past_turn(feedback, reply, self._profile, cues, self._number()))
        self._pictures.append(picture if self._profile.row.images else None)

    def _number(self) -> int | None:
        """Return the number of the current frame; None if the profile labels frames `current` and `past` instead."""
        return len(self._turns) + 1 if self._profile.row.is_append_only else None

    def _with_system(self, messages: list[Message]) -> list[Message]:
        if self._profile.system_role == "system":
            return [Message("system", self._system), *messages]
        first = messages[0]  # chat templates without a system role also refuse two messages of one role in a row
        return [replace(first, text=f"{self._system}\n\n{first.text}"), *messages[1:]]
