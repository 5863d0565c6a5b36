"""Runs of scripted agents, played in the test's process without any worker process."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from vigil.agents.scripted import scripted_agent
from vigil.assets.database import AssetDatabase
from vigil.base.json_lines import dump_line
from vigil.base.versions import Versions
from vigil.env import Env
from vigil.packs.pack import Pack
from vigil.protocol.profile import Profile
from vigil.protocol.prompt import policy_sha256, policy_version
from vigil.records.record import EPISODES_FILE, FRAMES_FOLDER, RunHeader, RunSpec
from vigil.runner.run_folder import new_nonce, write_header
from vigil.runner.workers.frames import FrameStore
from vigil.runner.workers.worker import play
from vigil.sim import make_simulator


def make_run(
    folder: Path,
    pack: Pack,
    agent: str,
    *,
    frames: bool,
    simulator: str = "fake",
    profile: Profile | None = None,
    **facts: Any,
) -> Path:
    """Play a pack with a scripted agent; `facts` are further fields of the header."""
    folder.mkdir(parents=True)
    profile = profile or Profile()
    spec = RunSpec(
        agent=agent,
        agent_kind="scripted",
        profile=profile,
        prompt_policy=policy_version(profile),
        prompt_policy_sha256=policy_sha256(profile),
        pack=pack.name,
        pack_sha256=pack.sha256,
        episode_ids=tuple(episode.id for episode in pack.episodes),
        versions=Versions.current(),
        pack_versions=pack.manifest.versions,
        simulator=simulator,
    )
    fields = {"run_id": folder.name, "nonce": new_nonce(), "spec": spec, "package_version": "0", **facts}
    header = RunHeader(**fields, started=datetime.now(UTC))
    store = FrameStore(folder / FRAMES_FOLDER)
    env = Env(make_simulator(simulator, assets=AssetDatabase.default()), pack.house_of, profile)
    with (folder / EPISODES_FILE).open("wb") as rows:
        for episode in pack.episodes:
            play(
                episode,
                env,
                scripted_agent(agent, 3),
                on_reply=lambda observation, _: store.save(observation.rgb) if frames else None,
            )
            record = env.record()
            assert record.end != "error", record.error
            rows.write(dump_line(header.stamp(record)))
    write_header(folder, header.model_copy(update={"ended": datetime.now(UTC)}))
    return folder
