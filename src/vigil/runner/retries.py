"""Retries of a run: what is tried again, how often, and how long a run waits in between.

- A request that fails because of transport, a rate limit, an outage or a time-out is sent again `RetryPolicy.retries`
  times (`vigil.runner.models.ask`); then its episode ends as `error`.
- A request that the provider rejects because of its content or length is sent `MAX_REJECTIONS` times in all. If the
  agent has not replied yet in the episode, the episode then ends as `error`. Otherwise the rejection counts as a
  protocol failure of the agent.
- An episode that ends as `error`, but not because of a model, is played `ATTEMPTS` times in all (`vigil.runner.run`).
- An episode whose worker is lost continues in another worker `MAX_RESTORES` times (`vigil.runner.workers.pool`).

If the same command is given again, it plays the episodes that ended as `error` again.
"""

from collections.abc import Callable
from dataclasses import dataclass

from tenacity import RetryCallState, wait_exponential, wait_random_exponential

MAX_REJECTIONS = 3
"""Number of rejections after which a request is not sent again."""
ATTEMPTS = 3
"""Maximum number of attempts at an episode before its `error` row is written."""
MAX_RESTORES = 2
"""Maximum number of times that an episode is restored in another worker before it counts as lost."""


@dataclass(frozen=True, slots=True)
class RetryPolicy:
    """The number of retries, and the waits before them. Each wait is twice the previous wait, with random jitter,
    unless the provider asks for another wait."""

    retries: int = 8
    first_wait_s: float = 1.0
    longest_wait_s: float = 60.0
    on_retry: Callable[[str], None] = lambda _: None
    """Function that is called with a line about each failure before it is retried."""

    def wait_s(self, state: RetryCallState) -> float:
        """Return the seconds to wait after a failed attempt. One half is fixed, the other random."""
        half = {"multiplier": self.first_wait_s / 2, "max": self.longest_wait_s / 2}
        own = (wait_exponential(**half) + wait_random_exponential(**half))(state)
        asked_s = getattr(_failure(state), "wait_s", None)
        return own if asked_s is None else max(own, min(asked_s, self.longest_wait_s))

    def report_retry(self, state: RetryCallState) -> None:
        """Report a failed attempt before the wait for the next attempt."""
        self.on_retry(f"try {state.attempt_number + 1} in {state.upcoming_sleep:.0f} s after {_failure(state)}")


def _failure(state: RetryCallState) -> BaseException | None:
    return state.outcome.exception() if state.outcome else None
