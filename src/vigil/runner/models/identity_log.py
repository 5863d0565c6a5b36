"""What really answered: names, addresses and endings that a provider's answers tell, not the settings."""

from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version

from vigil.errors import RecordError
from vigil.protocol.actions import Reply
from vigil.protocol.reasoning import Thinking
from vigil.records.record import ProviderFacts

CLIENTS = ("inspect_ai", "openai", "anthropic", "google-genai", "mistralai", "azure-ai-inference", "httpx2")


@dataclass(slots=True)
class ModelIdentityLog:
    """Takes in the answers of one session, those of the check before the run among them."""

    earlier_names: Collection[str] = ()
    """Names under which the model answered in earlier sessions; another one is refused. Empty: any name will do."""
    asked: Thinking = "default"
    effort: str | None = None
    set_by: str = ""
    """Description of how thinking was set."""
    on_new_identity: Callable[[], None] = lambda: None
    """Called when a name or an address is new."""
    redact: Callable[[str], str] = lambda text: text
    """Takes secrets out of a text: a server may send back what it was sent."""
    check: dict[str, str] = field(default_factory=dict)
    """Results of the check before the run, by its parts."""
    models: Counter[str] = field(default_factory=Counter)
    finish_reasons: Counter[str] = field(default_factory=Counter)
    addresses: set[str] = field(default_factory=set)
    replies: int = 0
    with_reasoning: int = 0

    def note(self, reply: Reply, model: str | None, address: str) -> None:
        """Take in an answer. Raises RecordError when another model answers than in earlier sessions."""
        model, address = self.redact(model or ""), self.redact(address)
        if model and self.earlier_names and model not in self.earlier_names:
            names = " or ".join(map(repr, sorted(self.earlier_names)))
            raise RecordError(
                f"The provider answers as {model!r} now; the rows of this run were answered as {names}. A name that "
                "stands for another model than before makes another run: give a new --log-dir, or go on with --force."
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
        """Return what was taken in, as a run's header keeps it."""
        state = {"on": "on", "off": "off"}.get(self.asked, "unknown")
        if self.effort is not None:
            state = "off" if self.effort == "none" else "on"
        return ProviderFacts.model_validate(
            {
                "replies": self.replies,
                "models": dict(sorted(self.models.items())),
                "finish_reasons": dict(sorted(self.finish_reasons.items())),
                "addresses": tuple(sorted(self.addresses)),
                "thinking": "on" if self.with_reasoning else state,
                "thinking_set_by": self.set_by,
                "replies_with_reasoning": self.with_reasoning,
                "check": dict(self.check),
                "clients": client_versions(),
            }
        )


def client_versions() -> dict[str, str]:
    """Return the versions of the installed clients of models."""
    found = {}
    for name in CLIENTS:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found
