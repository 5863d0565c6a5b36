"""Why a model stopped: one table of the finish and stop reasons of all providers, with their meanings.

A record stores the provider's word, and this table says what the word means. If a reply has no usable text and its word
is missing or not in the table, the failure is not counted against the model (`vigil.runner.models.ask`). Source:
`protocol.md` section 2.3, and the references of the providers.
"""

from typing import Literal, NamedTuple

StopCause = Literal["finished", "cut", "full", "tool call", "filtered", "failed"]
MEANINGS: dict[StopCause, str] = {
    "finished": "the model's answer, whatever it is",
    "cut": "cut by the limit on tokens: `truncated` if it is not an action",
    "full": "cut because the context was full: `truncated`, before the first reply an `error`",
    "tool call": "the model's answer: an invalid reply if it has no text",
    "filtered": "rejection: three in a row are a protocol failure, before the first reply an `error`",
    "failed": "failure of the infrastructure, retried, whatever text came",
}


class FinishReason(NamedTuple):
    """The meaning of a finish reason, and the providers that send it."""

    ending: StopCause
    senders: str
    """Providers that send the finish reason: names in REFERENCES, separated by commas."""


REFERENCES: dict[str, str] = {
    "OpenAI": "https://platform.openai.com/docs/api-reference/chat/object",
    "Anthropic": "https://platform.claude.com/docs/en/build-with-claude/handling-stop-reasons",
    "Google": "https://ai.google.dev/api/generate-content#FinishReason",
    "Bedrock": "https://docs.aws.amazon.com/bedrock/latest/APIReference/API_runtime_Converse.html",
    "Mistral": "https://docs.mistral.ai/api",
    "Zhipu": "https://docs.z.ai/api-reference/llm/chat-completion",
    "DeepSeek": "https://api-docs.deepseek.com/api/create-chat-completion",
    "OpenRouter": "https://openrouter.ai/docs/api-reference/overview",
    "Together": "https://docs.together.ai/reference/chat-completions-1",
    "vLLM": "https://github.com/vllm-project/vllm/blob/main/vllm/v1/engine/__init__.py",
    "SGLang": "https://github.com/sgl-project/sglang/blob/main/python/sglang/srt/managers/schedule_batch.py",
    "TGI": "https://huggingface.co/docs/text-generation-inference/en/reference/api_reference",
    "Ollama": "https://github.com/ollama/ollama/blob/main/docs/api.md",
    "LM Studio": "https://lmstudio.ai/docs/typescript/api-reference/llm-prediction-stop-reason",
    "Cohere": "https://docs.cohere.com/reference/chat",
    "watsonx": "https://ibm.github.io/watsonx-ai-node-sdk/",
    "Inspect": "https://inspect.aisi.org.uk/reference/inspect_ai.model.html",
}
"""URLs where providers list their finish reasons. OpenAI-compatible providers without an entry use OpenAI's list."""

FINISH_REASONS: dict[str, FinishReason] = {
    "stop": FinishReason("finished", "OpenAI, Google, Inspect"),
    "completed": FinishReason("finished", "OpenAI"),
    "end_turn": FinishReason("finished", "Anthropic, Bedrock"),
    "stop_sequence": FinishReason("finished", "Anthropic, Bedrock, TGI, Cohere"),
    "eos": FinishReason("finished", "Together"),
    "eos_token": FinishReason("finished", "TGI"),
    "complete": FinishReason("finished", "Cohere"),
    "eosfound": FinishReason("finished", "LM Studio"),
    "stopstringfound": FinishReason("finished", "LM Studio"),
    "length": FinishReason("cut", "OpenAI"),
    "max_tokens": FinishReason("cut", "Anthropic, Bedrock, Google, Cohere, Inspect"),
    "max_output_tokens": FinishReason("cut", "OpenAI"),
    "maxpredictedtokensreached": FinishReason("cut", "LM Studio"),
    "model_length": FinishReason("full", "Mistral, Inspect"),
    "model_context_window_exceeded": FinishReason("full", "Anthropic, Bedrock, Zhipu"),
    "contextlengthreached": FinishReason("full", "LM Studio"),
    "tool_calls": FinishReason("tool call", "OpenAI, Inspect"),
    "function_call": FinishReason("tool call", "OpenAI"),
    "tool_use": FinishReason("tool call", "Anthropic, Bedrock"),
    "malformed_tool_use": FinishReason("tool call", "Bedrock"),
    "tool_call": FinishReason("tool call", "Cohere"),
    "malformed_function_call": FinishReason("tool call", "Google"),
    "unexpected_tool_call": FinishReason("tool call", "Google"),
    "too_many_tool_calls": FinishReason("tool call", "Google"),
    "toolcalls": FinishReason("tool call", "LM Studio"),
    "content_filter": FinishReason("filtered", "OpenAI, DeepSeek, OpenRouter, Inspect"),
    "content_filtered": FinishReason("filtered", "Bedrock"),
    "guardrail_intervened": FinishReason("filtered", "Bedrock"),
    "refusal": FinishReason("filtered", "Anthropic"),
    "sensitive": FinishReason("filtered", "Zhipu"),
    "safety": FinishReason("filtered", "Google"),
    "recitation": FinishReason("filtered", "Google"),
    "language": FinishReason("filtered", "Google"),
    "blocklist": FinishReason("filtered", "Google"),
    "prohibited_content": FinishReason("filtered", "Google"),
    "spii": FinishReason("filtered", "Google"),
    "model_armor": FinishReason("filtered", "Google"),
    "image_safety": FinishReason("filtered", "Google"),
    "image_prohibited_content": FinishReason("filtered", "Google"),
    "image_recitation": FinishReason("filtered", "Google"),
    "error_toxic": FinishReason("filtered", "Cohere"),
    "error": FinishReason("failed", "OpenRouter, Mistral, vLLM, Cohere, watsonx"),
    "failed": FinishReason("failed", "OpenAI, LM Studio"),
    "network_error": FinishReason("failed", "Zhipu"),
    "insufficient_system_resource": FinishReason("failed", "DeepSeek"),
    "load": FinishReason("failed", "Ollama"),
    "unload": FinishReason("failed", "Ollama"),
    "abort": FinishReason("failed", "vLLM, SGLang, Zhipu"),
    "cancelled": FinishReason("failed", "OpenAI, watsonx"),
    "time_limit": FinishReason("failed", "watsonx"),
    "timeout": FinishReason("failed", "Cohere"),
    "error_limit": FinishReason("failed", "Cohere"),
    "pause_turn": FinishReason("failed", "Anthropic"),
    "other": FinishReason("failed", "Google"),
    "finish_reason_unspecified": FinishReason("failed", "Google"),
    "malformed_response": FinishReason("failed", "Google"),
    "missing_thought_signature": FinishReason("failed", "Google"),
    "malformed_model_output": FinishReason("failed", "Bedrock"),
    "modelunloaded": FinishReason("failed", "LM Studio"),
    "userstopped": FinishReason("failed", "LM Studio"),
}
"""Finish reason in lower case -> its meaning. If the provider changed or stopped an answer, the model is not at
fault."""


def stop_cause(finish_reason: str | None) -> StopCause | None:
    """Return the meaning of a finish reason; None if it is unknown or missing."""
    found = FINISH_REASONS.get((finish_reason or "").strip().casefold().replace("-", "_"))
    return None if found is None else found.ending


def hit_token_limit(finish_reason: str | None) -> bool:
    """Return whether a finish reason means that the answer was cut at a token limit or at the end of the model's
    context."""
    return stop_cause(finish_reason) in ("cut", "full")
