"""Providers by name: hosts, variables with key and address, required client, and the switch for thinking.

A provider in OpenAI's style is reached directly at its address; any other provider, through Inspect's client of that
name. Names are case-sensitive.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from typing import Any

from vigil.base.json_files import is_object
from vigil.errors import SettingError, did_you_mean
from vigil.protocol.reasoning import Thinking

Fields = Mapping[str, Any]
"""Sampling settings, named as in `RunSettings`."""
ACCOUNT = "the account's address"
"""Text in place of an address, for a cloud that gives each account its own hosts."""


@dataclass(frozen=True, slots=True)
class ThinkingSwitch:
    """The fields that a request must have to turn a model's thinking on and off."""

    on: Fields
    off: Fields

    @classmethod
    def body(cls, on: Fields, off: Fields) -> "ThinkingSwitch":
        """Return a switch whose fields are added to the body of the request."""
        return cls({"extra_body": on}, {"extra_body": off})


EFFORT_SWITCH = ThinkingSwitch({"reasoning_effort": "medium"}, {"reasoning_effort": "none"})
TYPE_SWITCH = ThinkingSwitch.body({"thinking": {"type": "enabled"}}, {"thinking": {"type": "disabled"}})
ADAPTIVE_SWITCH = ThinkingSwitch.body({"thinking": {"type": "adaptive"}}, {"thinking": {"type": "disabled"}})
ENABLE_SWITCH = ThinkingSwitch.body({"enable_thinking": True}, {"enable_thinking": False})
ROUTED_SWITCH = ThinkingSwitch.body({"reasoning": {"enabled": True}}, {"reasoning": {"enabled": False}})
TEMPLATE_SWITCH = ThinkingSwitch.body(
    {"chat_template_kwargs": {"enable_thinking": True, "thinking": True}},
    {"chat_template_kwargs": {"enable_thinking": False, "thinking": False}},
)
"""Switch that sets an argument of a chat template, under both names that templates use for it."""


@dataclass(frozen=True, slots=True)
class Provider:
    """How a provider is reached. A provider without hosts is a local or custom server."""

    title: str
    hosts: tuple[str, ...] = ()
    """Host names of the provider; a name that begins with a dot stands for all hosts below it."""
    address: str = ""
    """Default address; empty when it is unknown, or when Inspect's client knows it."""
    keys: tuple[str, ...] = ()
    """Variables that may have the key; the first variable that is set counts."""
    addresses: tuple[str, ...] = ()
    """Variables that may have an address instead of the default."""
    is_openai_style: bool = False
    """Whether chat completions are sent to the provider's address itself, not through one of Inspect's clients."""
    signs_in: bool = False
    """Whether the provider signs in with the machine's cloud account when a key is not set."""
    sign_in_client: str = ""
    """Module that is needed for signing in, in addition to the client; the extra `azure` installs it."""
    thinking: ThinkingSwitch | None = None
    """Switch for the models' thinking; None if unknown."""
    extra: str = ""
    """Extra of `vigil-bench` that installs the client; empty when none is needed."""
    client: str = ""
    """Module of the client that `extra` installs."""
    is_in_tests: bool = True
    """Whether the tests run the client against a local server; False for clients that were tried once, by hand."""

    @property
    def is_installed(self) -> bool:
        """Whether the client is installed; True if no client is needed."""
        return not self.client or _is_importable(self.client)

    @property
    def can_sign_in(self) -> bool:
        """Whether the module for signing in is installed; True if no module is needed."""
        return not self.sign_in_client or _is_importable(self.sign_in_client)

    @property
    def needs_key(self) -> bool:
        """Whether the provider's hosts require a key."""
        return bool(self.hosts) and not self.signs_in

    @property
    def default_address(self) -> str:
        """Default address as text for the user; empty when it is unknown."""
        if self.address or not self.hosts:
            return self.address
        return ACCOUNT if self.hosts[0].startswith(".") else f"https://{self.hosts[0]}"

    @property
    def key_variable(self) -> str:
        """Variable with the key: the first that is set; if none is set, the first; empty if there are no variables."""
        return next((name for name in self.keys if os.environ.get(name)), self.keys[0] if self.keys else "")


def _is_importable(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except ModuleNotFoundError:  # a parent package is missing
        return False


def _with_usual_variables(prefix: str, provider: Provider) -> Provider:
    """Return a provider in which empty lists of variables are filled with names made from `prefix`."""
    stem = prefix.upper().replace("-", "_")
    keys = () if provider.signs_in or prefix == "mockllm" else (f"{stem}_API_KEY",)
    addresses = () if prefix == "mockllm" else (f"{stem}_BASE_URL",)
    return replace(provider, keys=provider.keys or keys, addresses=provider.addresses or addresses)


_openai_style = partial(Provider, is_openai_style=True)
_local_server = partial(_openai_style, thinking=TEMPLATE_SWITCH)
_anthropic = partial(Provider, thinking=EFFORT_SWITCH, extra="anthropic", client="anthropic")
_google = partial(Provider, thinking=EFFORT_SWITCH, extra="google", client="google.genai")
_AZURE = (".openai.azure.com", ".services.ai.azure.com", ".models.ai.azure.com", ".cognitiveservices.azure.com")
_AWS = (".amazonaws.com",)
_GOOGLE = (".googleapis.com",)
_TABLE: dict[str, Provider] = {
    "openai": _openai_style("OpenAI", ("api.openai.com", ".api.openai.com"), thinking=EFFORT_SWITCH),
    "openai/azure": Provider(
        "OpenAI's models on Azure",
        _AZURE,
        keys=("AZUREAI_OPENAI_API_KEY", "AZURE_OPENAI_API_KEY"),
        addresses=("AZUREAI_OPENAI_BASE_URL", "AZURE_OPENAI_BASE_URL", "AZURE_OPENAI_ENDPOINT"),
        signs_in=True,
        sign_in_client="azure.identity",
        thinking=EFFORT_SWITCH,
    ),
    "openai/bedrock": Provider(
        "OpenAI's models on Bedrock",
        _AWS,
        keys=("BEDROCK_OPENAI_API_KEY", "AWS_BEARER_TOKEN_BEDROCK"),
        addresses=("BEDROCK_OPENAI_BASE_URL", "AWS_BEDROCK_BASE_URL"),
        signs_in=True,
        thinking=EFFORT_SWITCH,
    ),
    "anthropic": _anthropic("Anthropic", ("api.anthropic.com",), keys=("ANTHROPIC_API_KEY", "ANTHROPIC_AUTH_TOKEN")),
    "anthropic/azure": _anthropic(
        "Anthropic's models on Azure",
        _AZURE,
        keys=("AZUREAI_ANTHROPIC_API_KEY", "AZURE_ANTHROPIC_API_KEY"),
        addresses=("AZUREAI_ANTHROPIC_BASE_URL", "AZURE_ANTHROPIC_BASE_URL"),
    ),
    "anthropic/bedrock": _anthropic(
        "Anthropic's models on Bedrock",
        _AWS,
        addresses=("ANTHROPIC_BEDROCK_BASE_URL", "BEDROCK_ANTHROPIC_BASE_URL"),
        signs_in=True,
    ),
    "anthropic/vertex": _anthropic(
        "Anthropic's models on Vertex",
        _GOOGLE,
        addresses=("ANTHROPIC_VERTEX_BASE_URL", "VERTEX_ANTHROPIC_BASE_URL"),
        signs_in=True,
    ),
    "google": _google(
        "Google Gemini",
        ("generativelanguage.googleapis.com",),
        keys=("GOOGLE_API_KEY", "GEMINI_API_KEY", "GOOGLE_USE_ADC"),
        addresses=("GOOGLE_BASE_URL", "GOOGLE_GEMINI_BASE_URL", "GEMINI_BASE_URL"),
    ),
    "google/vertex": _google(
        "Google Gemini on Vertex", _GOOGLE, addresses=("GOOGLE_VERTEX_BASE_URL", "VERTEX_BASE_URL"), signs_in=True
    ),
    "doubao": _openai_style(
        "ByteDance Doubao (Ark)",
        ("ark.cn-beijing.volces.com", "ark.ap-southeast.bytepluses.com"),
        "https://ark.cn-beijing.volces.com/api/v3",
        keys=("ARK_API_KEY",),
        addresses=("ARK_BASE_URL",),
        thinking=TYPE_SWITCH,
    ),
    "qwen": _openai_style(
        "Alibaba Qwen (DashScope)",
        ("dashscope-intl.aliyuncs.com", "dashscope.aliyuncs.com", "dashscope-us.aliyuncs.com"),
        "https://dashscope-intl.aliyuncs.com/compatible-mode/v1",
        keys=("DASHSCOPE_API_KEY",),
        addresses=("DASHSCOPE_BASE_URL",),
        thinking=ENABLE_SWITCH,
    ),
    "zhipu": _openai_style(
        "Zhipu GLM (Z.ai)",
        ("api.z.ai", "open.bigmodel.cn"),
        "https://api.z.ai/api/paas/v4",
        keys=("ZAI_API_KEY", "ZHIPUAI_API_KEY"),
        addresses=("ZAI_BASE_URL",),
        thinking=TYPE_SWITCH,
    ),
    "minimax": _openai_style(
        "MiniMax", ("api.minimax.io", "api.minimaxi.com"), "https://api.minimax.io/v1", thinking=ADAPTIVE_SWITCH
    ),
    "moonshot": Provider("Moonshot Kimi", ("api.moonshot.ai", "api.moonshot.cn"), thinking=TYPE_SWITCH),
    "deepseek": Provider("DeepSeek", ("api.deepseek.com",), thinking=TYPE_SWITCH),
    "openrouter": Provider("OpenRouter", ("openrouter.ai",), thinking=ROUTED_SWITCH),
    "together": Provider("Together", ("api.together.xyz", "api.together.ai"), thinking=ROUTED_SWITCH),
    "vllm": _local_server("vLLM", address="http://localhost:8000/v1"),
    "sglang": _local_server("SGLang", address="http://localhost:30000/v1"),
    "ollama": _local_server("Ollama", address="http://localhost:11434/v1", thinking=EFFORT_SWITCH),
    "lmstudio": _local_server("LM Studio", address="http://localhost:1234/v1", thinking=None),
    "llama-cpp": _local_server("llama.cpp", address="http://localhost:8080/v1"),
    "local": _local_server("any server, with --base-url"),
    "bedrock": Provider(
        "Amazon Bedrock",
        _AWS,
        addresses=("BEDROCK_BASE_URL", "AWS_ENDPOINT_URL_BEDROCK_RUNTIME", "AWS_ENDPOINT_URL"),
        signs_in=True,
    ),
    "sagemaker": Provider(
        "Amazon SageMaker",
        _AWS,
        addresses=("SAGEMAKER_BASE_URL", "AWS_ENDPOINT_URL_SAGEMAKER_RUNTIME", "AWS_ENDPOINT_URL"),
        signs_in=True,
    ),
    "azureai": Provider(
        "Azure AI",
        _AZURE,
        keys=("AZUREAI_API_KEY",),
        addresses=("AZUREAI_BASE_URL", "AZUREAI_ENDPOINT_URL", "AZURE_ENDPOINT_URL"),
        signs_in=True,
        extra="azure",
        client="azure.ai.inference",
        is_in_tests=False,
    ),
    "mistral": _openai_style("Mistral", ("api.mistral.ai",), "https://api.mistral.ai/v1"),
    "mistral/azure": Provider(
        "Mistral's models on Azure",
        _AZURE,
        keys=("AZUREAI_MISTRAL_API_KEY", "AZURE_MISTRAL_API_KEY"),
        addresses=("AZUREAI_MISTRAL_BASE_URL", "AZURE_MISTRAL_BASE_URL"),
        extra="mistral",
        client="mistralai",
        is_in_tests=False,
    ),
    "grok": _openai_style(
        "xAI Grok",
        ("api.x.ai", ".api.x.ai"),
        "https://api.x.ai/v1",
        keys=("XAI_API_KEY", "GROK_API_KEY"),
        addresses=("XAI_BASE_URL", "GROK_BASE_URL"),
    ),
    "groq": _openai_style("Groq", ("api.groq.com",), "https://api.groq.com/openai/v1"),
    "fireworks": Provider("Fireworks", ("api.fireworks.ai",)),
    "sambanova": Provider("SambaNova", ("api.sambanova.ai",)),
    "perplexity": Provider("Perplexity", ("api.perplexity.ai",)),
    "cloudflare": Provider("Cloudflare", ("api.cloudflare.com",), keys=("CLOUDFLARE_API_KEY", "CLOUDFLARE_API_TOKEN")),
    "hf-inference-providers": Provider("Hugging Face's providers", ("router.huggingface.co",), keys=("HF_TOKEN",)),
    "mockllm": Provider("Inspect's stand-in for a model"),
}
PROVIDERS = {name: _with_usual_variables(name, provider) for name, provider in _TABLE.items()}
"""Name of a provider (`provider` or `provider/service`) -> the provider."""
ANY_SERVICE = "openai-api"
"""First part of the name `openai-api/SERVICE/NAME`, for any service in OpenAI's style.

If the service is not in the table, its variables are named after it, e.g. SERVICE_API_KEY.
"""


@dataclass(frozen=True, slots=True)
class ModelName:
    """A model's name, separated into the provider and the name that is sent to the server."""

    prefix: str
    """Provider, or provider and service; empty when the name does not have a provider."""
    name: str
    """Name of the model as it is sent to the server."""
    provider: Provider
    is_known: bool = True
    """Whether the name begins with a known provider or `ANY_SERVICE`."""


def parse_model_name(model: str) -> ModelName:
    """Return the parts of a model's name. Without a known provider, the whole name is a model on a local server."""
    prefix, _, name = model.partition("/")
    if prefix == ANY_SERVICE:
        prefix, _, name = name.partition("/")
        known = PROVIDERS.get(prefix)
        provider = known or _with_usual_variables(prefix, Provider(prefix))
        return ModelName(prefix, name, replace(provider, is_openai_style=True))
    service, _, rest = name.partition("/")
    if f"{prefix}/{service}" in PROVIDERS:
        prefix, name = f"{prefix}/{service}", rest
    known = PROVIDERS.get(prefix)
    if known is None:
        return ModelName("", model, _TABLE["local"], is_known=False)
    return ModelName(prefix, name, known)


def provider_hint(model: str) -> str:
    """Return " Did you mean 'x'?" if a model's unknown provider is similar to a known provider; otherwise ""."""
    prefix, known = model.partition("/")[0], {*PROVIDERS, ANY_SERVICE}
    return "" if prefix in known else did_you_mean(prefix.casefold(), known)


def with_thinking(sampling: Mapping[str, Any], thinking: Thinking, model: ModelName) -> dict[str, Any]:
    """Return `sampling` with the settings that turn thinking on or off at a model's provider.

    Raises SettingError when the provider's switch is unknown, or when other settings contradict it.
    """
    if thinking == "default":
        return dict(sampling)
    effort = sampling.get("reasoning_effort")
    if effort is not None and (effort == "none") == (thinking == "on"):
        raise SettingError(
            f"--thinking {thinking} contradicts --reasoning-effort {effort}: leave one of them out, or make them agree."
        )
    switch = model.provider.thinking
    if switch is None:
        raise SettingError(
            f"--thinking {thinking}: how to set this for {model.provider.title} is unknown. Find the setting in "
            "the provider's documentation, and give it with --reasoning-effort, --model-arg or --extra-body."
        )
    wanted = dict(switch.on if thinking == "on" else switch.off)
    if effort is not None:
        wanted.pop("reasoning_effort", None)
    return _merge(sampling, wanted, thinking)


def describe_switch(thinking: Thinking, model: ModelName) -> str:
    """Return a text with the fields that --thinking sends, e.g. `extra_body.enable_thinking=True`; may be empty."""
    switch = model.provider.thinking
    if thinking == "default" or switch is None:
        return ""
    return ", ".join(flatten_fields(switch.on if thinking == "on" else switch.off))


def flatten_fields(fields: Mapping[str, Any], place: str = "") -> list[str]:
    """Return each value in nested fields with the path to it, e.g. `extra_body.thinking.type=enabled`."""
    found: list[str] = []
    for name, value in fields.items():
        where = f"{place}.{name}".lstrip(".")
        found += flatten_fields(value, where) if is_object(value) else [f"{where}={value}"]
    return found


def _merge(there: Mapping[str, Any], wanted: Mapping[str, Any], thinking: Thinking) -> dict[str, Any]:
    merged = dict(there)
    for name, value in wanted.items():
        given = merged.get(name)
        if is_object(value) and (given is None or is_object(given)):
            merged[name] = _merge(given or {}, value, thinking)
        elif given is not None and given != value:
            raise SettingError(
                f"--thinking {thinking} sends {name}={value!r}, but --extra-body says {given!r}: leave one of them out."
            )
        else:
            merged[name] = value
    return merged
