"""The public API of `import vigil`: load a pack, play its episodes with your agent, and score the records.

    import vigil

    pack = vigil.load_pack("starter")
    with vigil.make_env(pack) as env:
        records = [vigil.play(episode, env, MyAgent()) for episode in pack.episodes]
    print(vigil.summarise(pack.episodes, records)["overall"])

An agent is an object with a `name` and the methods `start(instruction)` and `act(observation) -> vigil.Reply`. The
names in this module are stable; other modules may move between versions.
"""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from vigil.agents.agent import Agent
from vigil.assets.database import AssetDatabase
from vigil.env import Env
from vigil.errors import RecordError, VigilError
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.packs.pack import Pack
from vigil.protocol.actions import Reply
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.protocol.observation import Feedback, Observation, Quality
from vigil.protocol.profile import Profile
from vigil.records.record import EPISODES_FILE, EpisodeRecord
from vigil.records.record_file import read_records
from vigil.runner.plan import input_paths, run_spec
from vigil.runner.run_folder import RunFolder
from vigil.runner.workers import worker
from vigil.runner.workers.messages import SimulatorFacts
from vigil.scoring import summary
from vigil.scoring.outcomes import Outcome, score
from vigil.sim import BACKENDS, make_simulator
from vigil.thor.launch import thor_engine

__all__ = [
    "Agent",
    "Env",
    "Episode",
    "EpisodeRecord",
    "Feedback",
    "House",
    "Observation",
    "Outcome",
    "Pack",
    "Profile",
    "Reply",
    "VigilError",
    "generate_house",
    "load_pack",
    "make_env",
    "play",
    "read_records",
    "reply",
    "save_run",
    "score",
    "summarise",
    "thor_engine",
]


def load_pack(name: str | Path) -> Pack:
    """Return the packaged pack called `name`, or the pack in the folder `name`. Raises PackMismatch."""
    return Pack.load(name)


def make_env(
    pack: Pack,
    profile: Profile | None = None,
    *,
    backend: str = "mujoco",
    quality: Quality = "default",
    asset_database: Path | None = None,
) -> Env:
    """Return an environment for the episodes of `pack`; leaving its `with` block closes the simulator.

    `profile` sets what the agent is shown and how its replies are parsed (default: the paper's baseline). Quality
    `"fast"` draws frames two to three times faster, with rougher edges. Houses with objects of AI2-THOR need
    `asset_database`, AI2-THOR's file of object sizes. Raises SettingError for an unknown backend or a broken database,
    and PackMismatch if the pack was made with another database.
    """
    assets = AssetDatabase.from_file(asset_database)
    pack.check_assets(assets)
    simulator = make_simulator(backend, assets=assets, quality=quality)
    return Env(simulator, pack.house_of, profile or Profile())


def play(episode: Episode, env: Env, agent: Agent, *, run_id: str = "", epoch: int = 1) -> EpisodeRecord:
    """Play one episode to its end and return its record.

    The agent sees only the instruction and the observations. A failure of the agent's program or the simulator ends the
    episode as `error`, with the reason in the record. Such an episode is counted, but never scored.
    """
    worker.play(episode, env, agent)
    return env.record(run_id=run_id, epoch=epoch)


def save_run(folder: str | Path, pack: Pack, records: Iterable[EpisodeRecord], env: Env, *, agent: str) -> Path:
    """Write the records of a run, and return the run's folder.

    The agent named `agent` must have played the records' episodes, which belong to `pack`, in `env`. `vigil view`,
    `score`, `report` and `verify` open the folder like any other run. `folder` is new or empty. Raises SettingError for
    a record of another pack's episode, and RecordError if the folder already holds a run.
    """
    path, found = Path(folder), list(records)
    if (path / EPISODES_FILE).exists():
        raise RecordError(f"Folder {str(path)!r} already holds a run. Choose another folder.")
    spec = run_spec(
        pack,
        env.profile,
        agent=agent,
        agent_kind="scripted",
        episode_ids=tuple(sorted({pack.episode(record.episode_id).id for record in found})),
        epochs=max((record.epoch for record in found), default=1),
        render_quality="fast" if env.simulator_name.endswith("(fast)") else "default",
        simulator=next((name for name in BACKENDS if env.simulator_name.startswith(name)), env.simulator_name),
    )
    run = RunFolder.create_or_resume(path, spec, pack.episodes, input_paths(pack, None))
    try:
        run.note_facts(SimulatorFacts(env.simulator_name, ""))
        for record in found:
            run.append(record.model_copy(update={"run_id": run.header.run_id}))
        run.note_end()
    finally:
        run.close()
    return path


def reply(skill_name: str, **arguments: Any) -> Reply:
    """Return an agent's reply: a skill with its arguments, e.g. `reply("look", direction="up", magnitude=15)`."""
    return Reply(text=json.dumps({"skill_name": skill_name, "arguments": arguments}))


def summarise(episodes: Iterable[Episode], records: Iterable[EpisodeRecord], *, epochs: int = 1) -> dict[str, Any]:
    """Return the rates of the records as `{"overall": rates, "families": {family: rates}}`, with 95 % intervals.

    `episodes` are the planned episodes, to be played `epochs` times each; plays without a record count as missing.
    Raises RecordError for a record of any other episode.
    """
    return summary.summarise(summary.score_run(episodes, records, epochs))


def generate_house(seed: int, spec: str = "4") -> House:
    """Return the furnished house of a seed; `spec` is the number of rooms (1 to 10) or a name such as `kitchen`."""
    return generate(seed, spec_for(spec))
