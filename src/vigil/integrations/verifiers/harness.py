"""Harness of an episode's agent: it sends the messages of `vigil run` through a server that records them."""

from collections.abc import Awaitable, Callable
from typing import cast

import verifiers.v1 as vf  # pyright: ignore[reportMissingImports]
from openai import AsyncOpenAI

from vigil.agents.agent import REPLY_SECONDS
from vigil.errors import VigilError
from vigil.integrations.chat_client import chat_sender
from vigil.integrations.rewards import Verdict
from vigil.integrations.verifiers.taskset import VigilData, store_verdict
from vigil.runner.models.ask import Ask, with_retries
from vigil.runner.retries import RetryPolicy

PlayTask = Callable[[VigilData, Ask], Awaitable[Verdict]]
"""Function that plays an episode with a model. Raises VigilError if the episode could not be finished."""


class VigilHarness(vf.Harness[vf.HarnessConfig]):
    """Harness that plays in this process. Each turn sends a request with the prompt, the text history and the frame."""

    EXECUTES_CODE = False
    NEEDS_CONTAINER = False
    play: PlayTask | None = None
    """Function that plays an episode; set by the environment, which owns the simulators."""

    async def launch(
        self,
        ctx: vf.ModelContext,
        trace: vf.Trace,
        runtime: vf.Runtime,
        endpoint: str,
        secret: str,
        mcp_urls: dict[str, str],
        data: vf.TaskData,
    ) -> vf.ProgramResult:
        """Play the episode that `data` names, and store the verdict in the trace.

        Raises HarnessError if the episode could not be finished.
        """
        if self.play is None:
            raise vf.HarnessError("VIGIL's episodes need VIGIL's environment: leave out --env.id.")
        if data.system_prompt is not None:
            raise vf.HarnessError(
                "VIGIL's system prompt is part of its protocol: leave out --env.taskset.system-prompt, and do not "
                "limit the agent's network."
            )
        async with AsyncOpenAI(base_url=endpoint, api_key=secret, max_retries=0, timeout=REPLY_SECONDS) as client:
            ask = with_retries(chat_sender(client, ctx.model), RetryPolicy())
            try:
                store_verdict(trace, await self.play(cast(VigilData, data), ask))
            except VigilError as error:
                raise vf.HarnessError(str(error)) from error
        return vf.ProgramResult(exit_code=0, stdout="", stderr="")
