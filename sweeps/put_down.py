"""Clicks the thing of every "put it there" episode down at pixels of all kinds, and judges each try.

    python -m sweeps.put_down                       every such episode of the large pack, 60 clicks and more in each
    python -m sweeps.put_down --piece 3             one episode again

The recorded solution is played up to the click that puts the thing down. Then it is put down elsewhere instead: at
pixels of the receptacle, of its rim and its edges, and beside it; from there, a step back, looking up and down; and
once more after the receptacle was shut by a click. Of every try that wins it must hold that the thing rests on or in
the receptacle, and where the task says "into", that the receptacle is open and the thing's bottom lies below its rim.
"""

import json
import random
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

from sweeps import simulators
from sweeps.support import pieces
from sweeps.support.pieces import Failure, PieceResult
from vigil.env import Env
from vigil.packs.pack import Pack
from vigil.protocol.actions import Action, Reply
from vigil.protocol.episode import Episode
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.profile import Profile
from vigil.protocol.world import CLOSED_BELOW
from vigil.scene.geometry import bounding_box
from vigil.scoring.outcomes import score
from vigil.sim.privileged import PrivilegedSimulator

PACK = "vigil_balanced_1000"
CLICKS_ON_IT, CLICKS_BESIDE_IT = 14, 8
"""Number of clicks on the receptacle and next to it from each view, in addition to its four outermost pixels."""
BESIDE_PX = (12, 25)
"""Distances of clicks next to the receptacle, across and up."""
SHUT_CLICKS = 40
RIM_M = 0.02
"""Least distance of the bottom of what lies inside from the rim above."""
VIEWS: dict[str, dict[str, object] | None] = {
    "as solved": None,
    "looking up": {"skill_name": "look", "arguments": {"direction": "up", "magnitude": 20}},
    "looking down": {"skill_name": "look", "arguments": {"direction": "down", "magnitude": 20}},
    "a step back": {"skill_name": "navigate", "arguments": {"mode": "backward", "magnitude": 1}},
}
REPORT = {"skill_name": "report", "arguments": {"status": "success", "summary": ""}}
Pixel = tuple[int, int]


def main() -> int:
    """Run the sweep."""
    options = simulators.parser(__doc__ or "", len(_episodes())).parse_args()
    work = partial(try_everywhere, options.seed, options.backend)
    return pieces.run(simulators.sweep("put_down", work, options), options)


def _episodes() -> list[Episode]:
    return [episode for episode in Pack.load(PACK).episodes if episode.goal.kind == "object_at_receptacle"]


def try_everywhere(seed: int, backend: str, piece: int) -> PieceResult:
    """Return the result of the tries in one episode."""
    pack, episode = Pack.load(PACK), _episodes()[piece]
    simulator = simulators.loaded(backend, pack.house_of(episode))
    trial = _PutDownTrial(
        Env(simulator, pack.house_of, Profile()), simulator, episode, random.Random(f"{seed}/{piece}")
    )
    trial.play_until_put_down(pack.solutions[episode.id].actions)
    for state in ("open", "shut") if simulator.scene().things[trial.receptacle].is_openable else ("",):
        if state == "shut" and not trial.close_receptacle():
            trial.result.counts["could not be shut from there"] += 1
            continue
        for view in VIEWS:
            trial.try_view(state, view)
    trial.result.failures = [
        Failure(failure.kind, failure.detail, f"--piece {piece}") for failure in trial.result.failures
    ]
    simulator.close()
    return trial.result


class _PutDownTrial:
    """An episode in which the hand holds the thing, to put down in many ways."""

    def __init__(self, env: Env, simulator: PrivilegedSimulator, episode: Episode, rng: random.Random) -> None:
        self.result = PieceResult()
        self.receptacle = str(getattr(episode.goal, "receptacle_id", ""))
        self._is_into = bool(getattr(episode.goal, "inside", False))
        self._env, self._simulator, self._episode, self._rng = env, simulator, episode, rng

    def play_until_put_down(self, actions: tuple[Action, ...]) -> None:
        """Play a solution up to its last `place`."""
        places = [n for n, action in enumerate(actions) if getattr(action, "intent", "") == "place"]
        self._env.reset(self._episode)
        for action in actions[: places[-1]]:
            arguments = action.model_dump(exclude={"skill_name", "raw_status"}, exclude_none=True)
            self._send({"skill_name": action.skill_name, "arguments": arguments})

    def close_receptacle(self) -> bool:
        """Shut the receptacle by a click; return whether a click did so."""
        pixels = self._simulator.pixels_of(self.receptacle)
        for x, y in pixels[:: max(1, len(pixels) // SHUT_CLICKS)]:
            if self._env.end is None:
                self._send(_interact("close_access", (int(x), int(y))))
            if self._simulator.scene().things[self.receptacle].openness < CLOSED_BELOW:
                return self._env.end is None
        return False

    def try_view(self, state: str, view: str) -> None:
        """Try clicks of all kinds from a view."""
        with self._restoring():
            turn = VIEWS[view]
            if turn is not None:
                self._send(turn)
            if self._env.end is None:
                for click in self._clicks():
                    with self._restoring():
                        self._try(state, view, click)

    def _clicks(self) -> list[Pixel]:
        pixels = [(int(x), int(y)) for x, y in self._simulator.pixels_of(self.receptacle)]
        if not pixels:
            return []
        chosen = [self._rng.choice(pixels) for _ in range(CLICKS_ON_IT)]
        edges = [pick(pixels, key=lambda pixel: pixel[axis]) for axis in (0, 1) for pick in (min, max)]
        return [*chosen, *edges, *(self._click_beside(click) for click in chosen[:CLICKS_BESIDE_IT])]

    def _click_beside(self, click: Pixel) -> Pixel:
        across, up = BESIDE_PX
        x = click[0] + self._rng.randint(-across, across)
        y = click[1] - self._rng.randint(0, up)
        return min(max(x, 0), FRAME_WIDTH - 1), min(max(y, 0), FRAME_HEIGHT - 1)

    def _try(self, state: str, view: str, click: Pixel) -> None:
        self._send(_interact("place", click))
        step = self._env._steps[-1]
        self._send(REPORT)
        outcome = score(self._episode, self._env.record())
        refusal = step.effect.refusal if step.effect else "invalid"
        self.result.counts[f"{state} {'W' if outcome.W else refusal or 'elsewhere'}".strip()] += 1
        if outcome.W:
            self.result.failures += [
                Failure(kind, f"{self._episode.id}, {view}, click at {click}", "") for kind in self._faults()
            ]

    def _faults(self) -> Iterator[str]:
        things = self._simulator.scene().things
        thing, receptacle = things[self._episode.goal.object_id], things[self.receptacle]
        if receptacle.id not in _carriers(thing.parent, {each.id: each.parent for each in things.values()}):
            yield "won beside the receptacle"
        if not self._is_into:
            return
        if receptacle.is_openable and receptacle.openness < CLOSED_BELOW:
            yield "won into what is shut"
        box, rim = bounding_box(thing), bounding_box(receptacle)
        if box.center.y - box.size.y / 2 > rim.center.y + rim.size.y / 2 - RIM_M:
            yield "won on the rim"

    def _send(self, reply: dict[str, object]) -> None:
        if self._env.end is None:
            self._env.step(Reply(text=json.dumps(reply)))

    @contextmanager
    def _restoring(self) -> Iterator[None]:
        """Leave the episode and the world as they were."""
        env = self._env
        before = (list(env._steps), env._end, env._invalid, env._observation)
        with self._simulator.rollback():
            yield
        env._steps, env._end, env._invalid, env._observation = before


def _interact(intent: str, click: Pixel) -> dict[str, object]:
    return {"skill_name": "interact_pixel", "arguments": {"intent": intent, "x": click[0], "y": click[1]}}


def _carriers(parent: str | None, parents: dict[str, str | None]) -> Iterator[str]:
    while parent is not None:
        yield parent
        parent = parents.get(parent)


if __name__ == "__main__":
    sys.exit(main())
