"""Which model answered: names, addresses and finish reasons from the provider's answers, not from the settings."""

from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Literal

from vigil.errors import RecordError
from vigil.protocol.actions import Reply
from vigil.records.record import ProviderFacts

CLIENTS = ("inspect_ai", "openai", "anthropic", "google-genai", "mistralai", "azure-ai-inference", "httpx2")
"""Python packages of clients whose versions are recorded."""


@dataclass(slots=True)
class ModelIdentityLog:
    """Log of the answers in one session of a run, including the answers to the check before the run."""

    earlier_names: Collection[str] = ()
    """Names under which the model answered in earlier sessions. An answer under any other name is refused. If empty,
    all names are accepted."""
    thinking: Literal["on", "off", "unknown"] = "unknown"
    """Thinking mode that the user set."""
    set_by: str = ""
    """Text with the request fields that set thinking on or off."""
    on_new_identity: Callable[[], None] = lambda: None
    """Function that is called when a name or an address is new."""
    redact: Callable[[str], str] = lambda text: text
    """Function that removes secrets from a text, because a server's answer may repeat the key of the request."""
    check: dict[str, str] = field(default_factory=dict[str, str])
    """Results of the check before the run: part of the check -> result."""
    models: Counter[str] = field(default_factory=Counter[str])
    finish_reasons: Counter[str] = field(default_factory=Counter[str])
    addresses: set[str] = field(default_factory=set[str])
    replies: int = 0
    with_reasoning: int = 0

    def note(self, reply: Reply, model: str | None, address: str) -> None:
        """Add an answer to the log. Raises RecordError when another model answers than in earlier sessions."""
        model, address = self.redact(model or ""), self.redact(address)
        if model and self.earlier_names and model not in self.earlier_names:
            names = " or ".join(map(repr, sorted(self.earlier_names)))
            raise RecordError(
                f"The provider answers as {model!r} now, but the earlier rows of this run were answered by "
                f"{names}. Answers of different models do not belong in one run: give a new --log-dir, or continue "
                "anyway with --force."
            )
        is_new = (model != "" and model not in self.models) or (address != "" and address not in self.addresses)
        self.replies += 1
        self.with_reasoning += reply.reasoning_chars > 0
        self.finish_reasons[self.redact(reply.finish_reason or "none")] += 1
        if model:
            self.models[model] += 1
        if address:
            self.addresses.add(address)
        if is_new:
            self.on_new_identity()

    def provider_facts(self) -> ProviderFacts:
        """Return the logged facts in the form of a run's header."""
        return ProviderFacts(
            replies=self.replies,
            models=dict(sorted(self.models.items())),
            finish_reasons=dict(sorted(self.finish_reasons.items())),
            addresses=tuple(sorted(self.addresses)),
            thinking="on" if self.with_reasoning else self.thinking,
            thinking_set_by=self.set_by,
            replies_with_reasoning=self.with_reasoning,
            check=dict(self.check),
            clients=client_versions(),
        )


@cache
def client_versions() -> dict[str, str]:
    """Return {package: version} of the installed client libraries of models."""
    found: dict[str, str] = {}
    for name in CLIENTS:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found
