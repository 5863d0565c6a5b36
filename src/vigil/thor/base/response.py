"""An answer of the engine, and who gives answers: what the wires know of it."""

# pyright: reportReturnType=false

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from vigil.thor.base.images import Image


@dataclass(frozen=True, slots=True)
class EngineResponse:
    """What is sent back after an action."""

    metadata: dict[str, Any]
    """Of the whole; with `is_patch`, only what changed of the agent's."""
    images: list[Image] = field(default_factory=list)
    is_patch: bool = False


class Responder(Protocol):
    """The engine, as a wire sees it."""

    def first_response(self) -> EngineResponse:
        """Return what is sent before any action."""

    def respond(self, sent: Mapping[str, Any]) -> EngineResponse:
        """Carries out one action. What fails is said in the answer."""
