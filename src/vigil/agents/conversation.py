"""Messages that are sent to a vision-language model: the system prompt, a bounded text history and the current frame.

`vigil.runner.models.inspect_model` sends the messages and returns the reply. Source: `protocol.md` section 2.1.
"""

from dataclasses import dataclass, replace
from typing import Literal

from vigil.agents.frame_encoding import EncodedFrame
from vigil.protocol.observation import Feedback
from vigil.protocol.profile import Profile
from vigil.protocol.prompt import Turn, frame_stub, past_turn, recent_turns, system_prompt


@dataclass(frozen=True, slots=True)
class Message:
    """One message of a chat. Only the last message of a chat has an image."""

    role: Literal["system", "user", "assistant"]
    text: str
    picture: EncodedFrame | None = None


class Conversation:
    """The messages of one episode. The history has only text, because past frames are dropped."""

    def __init__(self, profile: Profile, instruction: str) -> None:
        self._profile = profile
        self._system = system_prompt(instruction, profile)
        self._turns: list[Turn] = []

    def messages(self, picture: EncodedFrame, feedback: Feedback | None) -> list[Message]:
        """Return all messages for the current observation."""
        messages: list[Message] = []
        for turn in recent_turns(self._turns, self._profile):
            messages += [Message("user", turn.stub), Message("assistant", turn.reply)]
        messages.append(Message("user", frame_stub("current", feedback), picture))
        if self._profile.system_role == "system":
            return [Message("system", self._system), *messages]
        first = messages[0]  # chat templates without a system role also refuse two messages of one role in a row
        return [replace(first, text=f"{self._system}\n\n{first.text}"), *messages[1:]]

    def add(self, feedback: Feedback | None, reply: str) -> None:
        """Add a finished turn to the history: the JSON text that was sent with the turn's frame, and the raw reply."""
        self._turns.append(past_turn(feedback, reply, self._profile))
