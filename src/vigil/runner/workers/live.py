"""One episode, played by a model in the main process with its Env in a simulator worker."""

from collections.abc import Callable, Sequence
from datetime import UTC, datetime

from vigil.agents.conversation import Conversation, Message
from vigil.base.versions import Versions
from vigil.errors import InfrastructureError, SimulatorError
from vigil.processes.worker import WorkerLost
from vigil.protocol.actions import Reply
from vigil.protocol.finish_reasons import stop_cause
from vigil.protocol.profile import Profile
from vigil.records.record import Boundary, EpisodeRecord, ErrorFact
from vigil.runner.models.ask import Ask, RequestRejected
from vigil.runner.models.context import CONTEXT_ERROR, size_hint
from vigil.runner.workers.messages import Assignment, EncodedObservation
from vigil.runner.workers.pool import LiveEpisode


async def play_live(
    live: LiveEpisode, profile: Profile, ask: Ask, run_id: str, on_first_frame: Callable[[], None] = lambda: None
) -> EpisodeRecord:
    """Play one episode and return its record; a failure outside the agent ends it as `error`. Raises InputError.

    `on_first_frame` is called before the agent is shown the first frame.
    """
    started = datetime.now(UTC)
    try:
        return await _play(live, profile, ask, on_first_frame)
    except InfrastructureError as error:
        boundary = boundary_of(error)
        record = await live.fail(boundary, str(error))
        return record or error_record(live.assignment, run_id, boundary, str(error), started)
    finally:
        live.close()


async def _play(live: LiveEpisode, profile: Profile, ask: Ask, on_first_frame: Callable[[], None]) -> EpisodeRecord:
    conversation = Conversation(profile, live.assignment.episode.instruction)
    answer = await live.begin()
    has_replied = False
    if isinstance(answer, EncodedObservation):
        on_first_frame()
    while isinstance(answer, EncodedObservation):
        messages = conversation.messages(answer.picture, answer.feedback)
        reply = await _reply(ask, messages, has_replied=has_replied)
        has_replied = True
        conversation.add(answer.feedback, reply.text)
        answer = await live.advance(reply)
    return answer


async def _reply(ask: Ask, messages: Sequence[Message], *, has_replied: bool) -> Reply:
    """Return the agent's reply. A rejected request counts as a reply once the agent has replied before."""
    try:
        reply = await ask(messages)
    except RequestRejected as error:
        if not has_replied:
            hint = f" {size_hint(messages)}" if CONTEXT_ERROR.search(str(error)) else ""
            raise RequestRejected(f"{error}{hint}") from error
        return Reply(text="", finish_reason="rejected", provider_rejected=True)
    if not has_replied and stop_cause(reply.finish_reason) == "full":
        raise RequestRejected(f"The first answer ended with {reply.finish_reason}. {size_hint(messages)}")
    return reply


def boundary_of(error: InfrastructureError) -> Boundary:
    """Return the boundary at which a failure happened."""
    if isinstance(error, WorkerLost):
        return "worker"
    return "simulator" if isinstance(error, SimulatorError) else "model"


def error_record(
    assignment: Assignment, run_id: str, boundary: Boundary, message: str, started: datetime
) -> EpisodeRecord:
    """Return the record of an episode of which only the failure is known."""
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
        error=ErrorFact(boundary=boundary, message=message),
    )
