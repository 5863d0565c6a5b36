"""A new agent: it walks ahead until what it sees stops changing, and then says that it has arrived.

    python examples/new_agent.py                                                          # plays three episodes
    vigil run --pack vigil_smoke --agent 'exec:python examples/new_agent.py --program'    # the same as a run

It sees only the instruction and the frames, so it must notice from them that a wall is in the way. When it
cannot do a task, it reports an honest `fail`.
"""

import base64
import io
import json
import sys

import numpy as np
from PIL import Image

import vigil

STILL = 1.0
"""Mean change of a colour value (0 to 255) below which two frames count as equal."""
WALKS = 5


class Walker:
    name = "walker"

    def start(self, instruction: str) -> None:
        self.is_to_walk = "metres" in instruction  # instructions to go somewhere say how near
        self.before = np.zeros((480, 640, 3), np.uint8)
        self.walks = 0

    def act(self, observation: vigil.Observation) -> vigil.Reply:
        if not self.is_to_walk:
            return vigil.reply("report", status="fail", summary="I can only walk.")
        change = np.abs(observation.rgb.astype(int) - self.before).mean()
        if change < STILL or self.walks == WALKS:
            return vigil.reply("report", status="success", summary="I went as far as I could.")
        self.before = observation.rgb
        self.walks += 1
        return vigil.reply("navigate", mode="forward", magnitude=3)


def serve(agent: Walker) -> None:
    """Answer observations on standard input, one JSON object per line (docs/agents.md)."""
    for line in sys.stdin:
        message = json.loads(line)
        if message["type"] == "start":
            agent.start(message["instruction"])
            continue
        frame = np.asarray(Image.open(io.BytesIO(base64.b64decode(message["frame"]["data"]))))
        print(agent.act(vigil.Observation(lambda frame=frame: frame)).text, flush=True)


def main() -> None:
    pack = vigil.load_pack("starter")
    episodes = [episode for episode in pack.episodes if episode.family == "DA"][:3]
    with vigil.make_env(pack, quality="fast") as env:
        for episode in episodes:
            outcome = vigil.score(episode, vigil.play(episode, env, Walker()))
            print(f"{outcome.label:5}  {outcome.steps} steps  {episode.instruction}")


if __name__ == "__main__":
    serve(Walker()) if "--program" in sys.argv else main()
