"""Players of a run: an agent inside a worker, or a model that is asked from the main process."""

from collections import deque
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from vigil.agents.conversation import Conversation, Message
from vigil.agents.frame_encoding import EncodedFrame
from vigil.base.processes.worker import Worker, WorkerLost
from vigil.base.versions import Versions
from vigil.env import cues_after, feedback_after
from vigil.errors import InfrastructureError, SimulatorError
from vigil.protocol.actions import Reply
from vigil.protocol.finish_reasons import stop_cause
from vigil.protocol.observation import Cues, Feedback
from vigil.protocol.profile import Profile
from vigil.records.record import Boundary, EpisodeRecord, ErrorFact, Key, StepRecord
from vigil.runner.models.ask import Ask, RequestRejected
from vigil.runner.models.context import CONTEXT_ERROR, size_hint
from vigil.runner.workers.messages import Assignment, EncodedObservation
from vigil.runner.workers.pool import LiveEpisode, SimulatorPool

PlayOne = Callable[[Assignment], Awaitable[EpisodeRecord]]
"""Function that plays one episode with a model. Raises VigilError to stop the run."""
PlayOnce = Callable[[Assignment, Callable[[], None]], Awaitable[EpisodeRecord]]
"""Function that plays one episode and returns its record. If something other than the agent fails, the episode ends as
`error`. Raises InputError. The second argument is called before the agent sees the first frame."""


async def play_in_worker(
    pool: SimulatorPool,
    worker: Worker,
    run_id: str,
    may_resume: bool,
    assignment: Assignment,
    on_first_frame: Callable[[], None],
) -> EpisodeRecord:
    """Play one episode with an agent that plays inside a worker, preferably in `worker`.

    `may_resume` says whether the agent continues in another worker when its worker is lost; True for a program.
    """
    started = datetime.now(UTC)
    try:
        return await pool.play(assignment, on_first_frame, may_resume=may_resume, worker=worker)
    except SimulatorError as error:
        return error_record(assignment, run_id, error, started)


@dataclass(frozen=True, slots=True)
class ModelPlayer:
    """Player for a model, which is asked from the main process."""

    pool: SimulatorPool
    profile: Profile
    ask: Ask
    run_id: str
    on_frame: Callable[[Key, int, EncodedFrame], None] = lambda _key, _step, _picture: None
    """Function that is called with episode and epoch, step and frame before each request."""

    async def play(self, assignment: Assignment, on_first_frame: Callable[[], None] = lambda: None) -> EpisodeRecord:
        """Play one episode. Several calls may play several episodes at the same time."""
        started, live = datetime.now(UTC), self.pool.live(assignment)
        criteria: list[Reply] = []
        try:
            record = await self._play(live, on_first_frame, criteria.append)
        except InfrastructureError as error:
            record = await live.fail(boundary_of(error), str(error))
            record = record or error_record(assignment, self.run_id, error, started)
        finally:
            live.close()
        return record.model_copy(update={"criteria": criteria[-1]}) if criteria else record

    async def _play(
        self, live: LiveEpisode, on_first_frame: Callable[[], None], on_criteria: Callable[[Reply], None]
    ) -> EpisodeRecord:
        assignment, fork = live.assignment, live.assignment.fork
        conversation = Conversation(self.profile, assignment.episode.instruction)
        answer = await live.begin()
        key, first = (assignment.episode.id, assignment.epoch), 0 if fork is None else fork.point.step
        step = first
        if isinstance(answer, EncodedObservation):
            if fork is not None:
                past = dict(enumerate(answer.past, start=1))
                max_steps = assignment.episode.max_steps
                deque(add_recorded_turns(conversation, fork.steps, self.profile, max_steps, past), maxlen=0)
            on_first_frame()
            if self.profile.row.declares_criteria:
                criteria = await ask_for_reply(
                    self.ask, conversation.opening_request(), self.profile, has_replied=False
                )
                on_criteria(criteria)
                conversation.declare(criteria.text)
        while isinstance(answer, EncodedObservation):
            messages = conversation.messages(answer.picture, answer.feedback, answer.cues)
            step += 1
            self.on_frame(key, step, answer.picture)
            reply = await ask_for_reply(self.ask, messages, self.profile, has_replied=step > first + 1)
            conversation.add(answer.feedback, reply.text, cues=answer.cues, picture=answer.picture)
            answer = await live.advance(reply)
        return answer


def add_recorded_turns(
    conversation: Conversation,
    steps: Sequence[StepRecord],
    profile: Profile,
    max_steps: int,
    pictures: Mapping[int, EncodedFrame],
) -> Iterator[tuple[StepRecord, Feedback | None, Cues | None]]:
    """Yield each recorded step with what was shown next to its frame; then the step becomes a turn of the conversation,
    exactly as it was shown to the model.

    `max_steps` is the episode's budget. `pictures` has frames by step; those not in the conversation may be missing.
    """
    feedback, cues = None, cues_after(None, profile, max_steps)
    for step in steps:
        yield step, feedback, cues
        conversation.add(feedback, step.reply.text, cues=cues, picture=pictures.get(step.index))
        feedback = feedback_after(step.effect, profile)
        cues = cues_after(step, profile, max_steps)


async def ask_for_reply(ask: Ask, messages: Sequence[Message], profile: Profile, *, has_replied: bool) -> Reply:
    """Return the agent's reply. A rejected request counts as a reply if the agent has replied before in the episode."""
    try:
        reply = await ask(messages)
    except RequestRejected as error:
        if not has_replied:
            hint = f". {size_hint(messages, profile)}" if CONTEXT_ERROR.search(str(error)) else ""
            raise RequestRejected(f"{str(error).rstrip('.')}{hint}") from error
        return Reply(text="", finish_reason="rejected", provider_rejected=True)
    if not has_replied and stop_cause(reply.finish_reason) == "full":
        raise RequestRejected(f"The first answer ended with {reply.finish_reason}. {size_hint(messages, profile)}")
    return reply


def boundary_of(error: InfrastructureError) -> Boundary:
    """Return the boundary (worker, simulator or model) at which a failure happened."""
    if isinstance(error, WorkerLost):
        return "worker"
    return "simulator" if isinstance(error, SimulatorError) else "model"


def error_record(assignment: Assignment, run_id: str, error: InfrastructureError, started: datetime) -> EpisodeRecord:
    """Return the record of an episode that failed before anything else about it was recorded."""
    return EpisodeRecord(
        versions=Versions.current(),
        run_id=run_id,
        episode_id=assignment.episode.id,
        epoch=assignment.epoch,
        attempt=assignment.attempt,
        started=started,
        ended=datetime.now(UTC),
        initial=None,
        steps=(),
        end="error",
        error=ErrorFact(boundary=boundary_of(error), message=str(error)),
        fork=None if assignment.fork is None else assignment.fork.point,
    )
