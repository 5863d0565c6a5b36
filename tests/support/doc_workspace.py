"""Workspace in which the commands of the pages are run: with runs, houses, a pack, and the project's programs."""

import json
import shutil
from pathlib import Path

from tests.support.doc_commands import ROOT
from tests.support.quick_runs import claim, quick
from tests.support.thor_files import write_asset_database
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.runner.run import run_pack

EPISODES = (
    "vigil_fridge_seed101",
    "vigil_laptop_seed101",
    "vigil_pillow_seed121_ai",
    "vigil_desklamp_seed121",
)
"""Episodes of the starter pack, in two houses that several commands draw."""
RUNS = {
    "a": ("random", "vllm/random"),
    "b": ("sweep", "vllm/sweep"),
    "gpt-4o": ("sweep", "openai/gpt-4o"),
    "qwen": ("random", "vllm/Qwen/Qwen3-VL-8B-Instruct"),
}
"""Run -> the agent that plays it, and the model to put into its header."""


def write_workspace(folder: Path) -> Path:
    """Write the files that the pages' commands read, and return the folder."""
    for name, (agent, model) in RUNS.items():
        run = folder / "runs" / name
        run_pack(quick(Path("starter"), run, agent=agent, episode_ids=EPISODES))
        _name_model(run / "run.json", model)
        claim(run)
    house = generate(7, spec_for("2"))
    house.save(folder / "house.json")
    (folder / "my_houses").mkdir()
    shutil.copy(folder / "house.json", folder / "my_houses" / "one.json")
    write_asset_database(folder)
    shutil.copytree(ROOT / "src/vigil/data/packs/vigil_smoke_v6", folder / "my_pack")
    (folder / "examples").symlink_to(ROOT / "examples")
    return folder


def _name_model(header: Path, model: str) -> None:
    facts = json.loads(header.read_text(encoding="utf-8"))
    facts["spec"] |= {"agent": model, "agent_kind": "model"}
    header.write_text(json.dumps(facts), encoding="utf-8")
