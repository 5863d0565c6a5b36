"""The engine's answers, and the protocol `Responder`, through which the connections (pipes and HTTP) use the engine."""

# pyright: reportReturnType=false

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from vigil.thor.base.images import Image


@dataclass(frozen=True, slots=True)
class EngineResponse:
    """The engine's answer to an action."""

    metadata: dict[str, Any]
    """All metadata. If `is_patch`, only those fields of the agent's metadata that changed."""
    images: list[Image] = field(default_factory=list)
    is_patch: bool = False


class Responder(Protocol):
    """An engine that answers actions."""

    def first_response(self) -> EngineResponse:
        """Return the answer that is sent before the first action."""

    def respond(self, sent: Mapping[str, Any]) -> EngineResponse:
        """Carry out one action and return the answer, which also says whether and why the action failed."""
