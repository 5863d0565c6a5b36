"""Check of what a trainer gets through verifiers, before the training (`vigil train doctor --with verifiers`).

A group of rollouts plays one episode against a model server with fixed replies. The samples that verifiers recorded are
then compared with the messages, frames and rewards of the same episode, played without verifiers.
"""

import asyncio
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from typing import Any

import verifiers.v1 as vf  # pyright: ignore[reportMissingImports] - an extra

from vigil.agents.conversation import Conversation
from vigil.agents.frame_encoding import encode_frame
from vigil.env import Env
from vigil.integrations.doctor import REPLIES, CheckResult, same
from vigil.integrations.rewards import reward_parts, verdict_of
from vigil.integrations.sources import SampledEpisode
from vigil.integrations.verifiers.env import VigilVerifiersEnv, load_environment
from vigil.protocol.actions import Reply
from vigil.protocol.profile import Profile
from vigil.records.record import EpisodeRecord

Parts = tuple[str, ...]
"""A message as its role, its text, and its picture as a `data:` URI if it has one."""


def examine_verifiers(options: dict[str, Any], group: int) -> Iterator[CheckResult]:
    """Yield the findings about a group of rollouts. Raises SettingError, PackMismatch or SimulatorError."""
    env = load_environment(**{"limit": 1, "workers": 1, **options})
    config = env.taskset.config
    row = next(iter(env.taskset)).data
    now = env.taskset.source.of_row(str(row.id), row.house)
    with _fixed_model() as url:
        traces = asyncio.run(_play(env, url, group))
    wrong = [error.message for trace in traces for error in trace.errors]
    yield CheckResult("rollouts end", not wrong, wrong[0][:80] if wrong else f"{len(traces)} members")
    if wrong:
        return
    with Env(config.make_simulator(), lambda _: now.house, config.condition) as alone:
        wanted, record = _requests(alone, now, config.condition)
    ids = {trace.task.data.id for trace in traces}
    yield CheckResult("group plays one episode", ids == {now.episode.id}, f"{len(traces)} members, {len(ids)} episodes")
    samples = [[_sample(branch.messages) for branch in trace.branches] for trace in traces]
    counts = sorted({len(each) for each in samples})
    yield CheckResult("each turn is a sample", counts == [len(REPLIES)], f"{counts} for {len(REPLIES)} turns")
    for check, part in (("roles and texts", slice(0, 2)), ("frames", slice(2, None))):
        flat = [[repr(message[part]) for sample in each for message in sample[:-1]] for each in samples]
        expected = [repr(message[part]) for request in wanted for message in request]
        yield from (same(f"{check}, member {number}", each, expected) for number, each in enumerate(flat, 1))
    replies = [sample[-1][1] for sample in samples[0]]
    yield same("replies", replies, [step.reply.text for step in record.steps])
    parts = reward_parts(verdict_of(record, now.episode, config.condition, now.answer), config.task)
    rewards = {trace.reward for trace in traces}
    yield CheckResult("rewards are those of the record", rewards == {sum(parts.values())}, f"{sorted(rewards)}")


async def _play(env: VigilVerifiersEnv, url: str, group: int) -> list[Any]:
    context = vf.ModelContext("fixed", vf.EvalClientConfig(base_url=url, api_key_var="NO_KEY"))
    task = next(iter(env.taskset))
    async with env.serving():
        slots = [slot for _ in range(group) for slot in env.slots(task)]
        played = await asyncio.gather(*(env.run_slot(slot, context) for slot in slots))
    return [trace for episode in played for trace in episode.traces]


def _requests(env: Env, now: SampledEpisode, condition: Profile) -> tuple[list[list[Parts]], EpisodeRecord]:
    """Return the messages of each request of an episode that is played with the fixed replies, and its record."""
    conversation, requests = Conversation(condition, now.episode.instruction), list[list[Parts]]()
    observation = env.reset(now.episode)
    for text in REPLIES:
        if observation is None:
            break
        picture = encode_frame(observation.rgb, condition.image_format)
        sent = conversation.messages(picture, observation.feedback, observation.cues)
        requests.append([(m.role, m.text, *([m.picture.data_uri] if m.picture else [])) for m in sent])
        conversation.add(observation.feedback, text, cues=observation.cues, picture=picture)
        observation = env.step(Reply(text=text))
    return requests, env.record()


def _sample(messages: Sequence[Any]) -> list[Parts]:
    """Return the messages of one sample: a request, and then the reply."""
    found = list[Parts]()
    for message in messages:
        if isinstance(message.content, str):
            found.append((message.role, message.content))
            continue
        text = "".join(part.text for part in message.content if part.type == "text")
        found.append((message.role, text, *(part.image_url.url for part in message.content if part.type != "text")))
    return found


class _FixedReplies(BaseHTTPRequestHandler):
    """Answers each chat request with the reply of its turn."""

    def do_POST(self) -> None:
        """Send reply number N (from 0) if the request contains N earlier replies."""
        request = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        turn = sum(message["role"] == "assistant" for message in request["messages"])
        message = {"role": "assistant", "content": REPLIES[min(turn, len(REPLIES) - 1)]}
        choice = {"index": 0, "message": message, "finish_reason": "stop"}
        usage = dict.fromkeys(("prompt_tokens", "completion_tokens", "total_tokens"), 1)
        answer = {"id": "1", "object": "chat.completion", "created": 0, "model": "fixed"}
        body = json.dumps({**answer, "choices": [choice], "usage": usage}).encode()
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Print nothing about requests."""


@contextmanager
def _fixed_model() -> Iterator[str]:
    """Run a model server on this machine; yield its URL."""
    with ThreadingHTTPServer(("127.0.0.1", 0), _FixedReplies) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        try:
            yield f"http://127.0.0.1:{server.server_port}/v1"
        finally:
            server.shutdown()
