"""verl's agent loop for VIGIL's episodes: each turn is a sample of its own, with its prompt and its frame.

From one request to the next, the oldest turn may leave the history and a placeholder replaces the past frame, so the
turns are not one growing conversation.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any
from uuid import uuid4

from omegaconf import DictConfig, OmegaConf  # pyright: ignore[reportMissingImports] - comes with verl
from PIL import Image
from verl.experimental.agent_loop.agent_loop import (  # pyright: ignore[reportMissingImports]
    AgentLoopBase,
    AgentLoopOutput,
)
from verl.utils.profiler import simple_timer  # pyright: ignore[reportMissingImports]

from vigil.agents.conversation import Message
from vigil.agents.frame_encoding import decode_frame
from vigil.errors import PackMismatch, VigilError
from vigil.integrations.options import VerlOptions
from vigil.integrations.rewards import reward_parts, verdict_of
from vigil.integrations.sources import worker_plan
from vigil.integrations.verl.rows import AGENT, source_of_options
from vigil.protocol.actions import Reply
from vigil.runner.models.ask import Ask
from vigil.runner.workers.players import ModelPlayer
from vigil.runner.workers.pool import SimulatorPool


class PlayedEpisodes:
    """Episodes with the simulators that play them. All rollouts of a process share them."""

    def __init__(self, options: VerlOptions) -> None:
        self._options, self._source = options, source_of_options(options)
        self._pool = SimulatorPool(worker_plan(self._source, options, AGENT), options.workers)

    async def play(self, row: Mapping[str, Any], ask: Ask) -> dict[str, float]:
        """Play the episode that a row names, and return the terms of its reward.

        Raises PackMismatch if the row is from another pack, or VigilError if the episode could not be finished.
        """
        episode_id, house, condition = row["episode_id"], row["house"], self._options.condition
        if row["source"] != self._source.name:
            raise PackMismatch(
                f"Episode {episode_id!r} is from {row['source']!r}, but this agent loop plays {self._source.name!r}. "
                "Write the rows with the same options and the same version of VIGIL."
            )
        house = None if house is None else int(house)
        assignment, answer = await self._source.assignment(episode_id, house)
        record = await ModelPlayer(self._pool, condition, ask, AGENT).play(assignment)
        if record.error is not None:
            raise VigilError(f"{record.error.boundary}: {record.error.message}")
        return reward_parts(verdict_of(record, assignment.episode, condition, answer), self._options)


@lru_cache
def _shared_episodes(options: str) -> PlayedEpisodes:
    """Return the episodes of this process for options in YAML."""
    return PlayedEpisodes(VerlOptions.of(OmegaConf.to_container(OmegaConf.create(options))))


class VigilAgentLoop(AgentLoopBase):
    """Agent loop that plays one episode, and returns one output for each turn.

    Its entry in verl's configuration of agent loops has the `options` of the episodes.
    """

    def __init__(self, *args: Any, options: DictConfig, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._episodes = _shared_episodes(OmegaConf.to_yaml(options, sort_keys=True))

    async def run(self, sampling_params: dict[str, Any], **row: Any) -> list[AgentLoopOutput]:
        """Play the episode of a row. Each output has the reward of the episode.

        Raises PackMismatch, VigilError, or ValueError if a prompt has more tokens than verl's configuration allows.
        """
        outputs = list[AgentLoopOutput]()

        async def ask(messages: Sequence[Message]) -> Reply:
            output = await self._turn(messages, sampling_params)
            outputs.append(output)
            return Reply(text=self.tokenizer.decode(output.response_ids, skip_special_tokens=True))

        parts = await self._episodes.play(row["extra_info"], ask)
        for output in outputs:
            output.reward_score = sum(parts.values())
            output.extra_fields |= {"turn_scores": [], "tool_rewards": [], "reward_extra_info": parts}
        return outputs

    async def _turn(self, messages: Sequence[Message], sampling_params: dict[str, Any]) -> AgentLoopOutput:
        """Ask the model once."""
        images = [Image.fromarray(decode_frame(m.picture.data)) for m in messages if m.picture is not None]
        self._assert_mm_supported(bool(images))
        prompt_ids = await self.ct_build_initial_tokens([_chat_message(m) for m in messages], images=images)
        metrics: dict[str, Any] = {}
        kwargs = self._get_mm_processor_kwargs()
        with simple_timer("generate_sequences", metrics):
            answer = await self.server_manager.generate(
                request_id=uuid4().hex,
                prompt_ids=prompt_ids,
                sampling_params=sampling_params,
                image_data=images,
                mm_processor_kwargs=kwargs,
            )
        metrics["num_preempted"] = -1 if answer.num_preempted is None else answer.num_preempted
        merged, mask, logprobs = await self.ct_merge_assistant_token(
            prompt_ids,
            answer.token_ids,
            [],
            [] if answer.log_probs else None,
            assistant_logprobs=answer.log_probs or None,
        )
        begin, end = len(merged.token_ids) - len(mask), self.rollout_config.response_length
        return AgentLoopOutput(
            prompt_ids=merged.token_ids[:begin],
            response_ids=merged.token_ids[begin:][:end],
            response_mask=mask[:end],
            response_logprobs=logprobs[:end] if logprobs else None,
            multi_modal_data={"images": images},
            mm_processor_kwargs=kwargs,
            num_turns=2,
            metrics=metrics,
            extra_fields=answer.extra_fields,
        )


def _chat_message(message: Message) -> dict[str, Any]:
    if message.picture is None:
        return {"role": message.role, "content": message.text}
    return {"role": message.role, "content": [{"type": "text", "text": message.text}, {"type": "image"}]}
