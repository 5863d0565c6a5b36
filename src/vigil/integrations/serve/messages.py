"""Messages between a server and its clients, in the form of OpenEnv's protocol.

A client gets only what `observation` returns, and a server reads only the fields of `ClientReply`.
"""

import base64
import binascii
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from vigil.protocol.actions import Reply, Usage
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.profile import Profile
from vigil.protocol.prompt import system_prompt
from vigil.protocol.reasoning import split_reasoning
from vigil.runner.workers.messages import EncodedObservation

SESSION_HEADER = "Vigil-Session"
"""Name of the HTTP header with the token of a session."""
MAX_MESSAGE_BYTES = 8 * 1024 * 1024
"""Maximum size of a client's message: the longest reply that a record can store, with every character escaped."""


class SessionError(Exception):
    """A request that cannot be carried out. The client gets the message, so it must not reveal hidden state."""

    def __init__(self, status: int, code: str, message: str) -> None:
        super().__init__(message)
        self.status, self.code, self.message = status, code, message


class ClientReply(BaseModel):
    """A client's reply, with what the client reports about the reply. The server adds all other facts."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    text: str = ""
    base64: str | None = None
    """Bytes of a reply that is not UTF-8, in base64; None if the reply is in `text`."""
    finish_reason: str | None = Field(default=None, max_length=100)
    usage: Usage | None = None
    provider_rejected: bool = False
    agent_ended: str = Field(default="", max_length=1000)
    """Why the client's program or model gave no answer; empty if it gave one."""

    def reply(self, seconds: float) -> Reply:
        """Return the reply as a record stores it, with the time that it took. Raises ValueError."""
        facts = self.model_dump(exclude={"text", "base64"})
        text: str | bytes = self.text
        if self.base64 is not None:
            try:
                text = base64.b64decode(self.base64, validate=True)
            except binascii.Error:
                raise ValueError("`base64` is not base64") from None
        reply = Reply.model_validate({**facts, "text": text, "seconds": round(seconds, 3)})
        return reply.model_copy(update={"reasoning_chars": split_reasoning(reply.text)[1]})


def client_reply(action: Mapping[str, Any]) -> ClientReply:
    """Return the client's reply from a request's `action`: an action of the protocol, or a dict with the key `text`.
    Raises ValidationError."""
    if "skill_name" in action:
        own = {name: value for name, value in action.items() if name != "metadata"}
        return ClientReply(text=json.dumps(own))
    return ClientReply.model_validate(action)


def action_of(reply: Reply) -> dict[str, Any]:
    """Return the action (dict) that a client sends to the server to give `reply`."""
    facts = {"finish_reason", "usage", "provider_rejected", "agent_ended"}
    action = reply.model_dump(mode="json", include=facts, exclude_defaults=True)
    return {**action, **({"text": reply.text} if reply.raw_base64 is None else {"base64": reply.raw_base64})}


@dataclass(frozen=True, slots=True)
class View:
    """What a client may see of its session at one moment."""

    instruction: str
    profile: Profile
    moment: int
    """Number of replies that were carried out before this view."""
    seen: EncodedObservation | None
    """The current observation; None when the episode is over."""
    reward: float | None = None
    """Reward of a finished episode, if the server is for training."""

    def message(self, token: str | None = None) -> dict[str, Any]:
        """Return the message for the client. `token` is set if the session has just begun."""
        observation: dict[str, Any] = {"moment": self.moment, "metadata": {}}
        if token is not None:
            prompt = system_prompt(self.instruction, self.profile)
            observation |= {"session": token, "instruction": self.instruction, "prompt": prompt}
        seen = self.seen
        if seen is not None:
            picture = {"media_type": seen.picture.media_type, "width": FRAME_WIDTH, "height": FRAME_HEIGHT}
            observation["frame"] = {**picture, "data": seen.picture.base64}
            if seen.feedback is not None:
                observation["feedback"] = seen.feedback.model_dump()
            if seen.cues is not None:
                observation |= seen.cues.model_dump(exclude_none=True)
        return {"observation": observation, "reward": self.reward, "done": seen is None}


NOTHING_LEFT: dict[str, Any] = {
    "observation": {"metadata": {}, "nothing_left": True},
    "reward": None,
    "done": True,
}
"""Answer to a client that asks for an episode when none is left."""
