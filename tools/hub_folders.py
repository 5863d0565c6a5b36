"""Writes folders that a maintainer can upload to hubs as they are.

python -m tools.hub_folders --owner OWNER --repository URL --commit COMMIT --out build/hubs
python -m tools.hub_folders ... --site site BUNDLE...

OUT/datasets has a folder for each packaged pack, OUT/register the entry for the register of Inspect Evals, and
OUT/every_eval_ever the results of the models on a leaderboard's site. docs/hubs.md says where each is published.
"""

import argparse
import json
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import yaml

from vigil.errors import InputError, SettingError
from vigil.integrations.exports.every_eval_ever.folder import write_results
from vigil.integrations.exports.options import Publisher
from vigil.packs.pack import Pack, packaged_names
from vigil.packs.private import check_revealed, is_private
from vigil.records.record import read_header
from vigil.web.leaderboard.bundle import unpack_bundle
from vigil.web.leaderboard.checking import ID_DIGITS, known_packs

ROOT = Path(__file__).parents[1]
OPENENV = ROOT / "examples" / "openenv" / "openenv.yaml"
TASK = Path("src/vigil/runner/inspect_task.py")
PAPER = "Done, But Not Sure: Disentangling World Completion from Self-Termination in Embodied Agents"
DESCRIPTION = (
    "Household episodes from egocentric RGB: measures whether an embodied agent reached the goal (W), and whether it "
    "also closed the episode with a true report (B)."
)


def write_dataset_folder(pack: Pack, owner: str, out: Path) -> Path:
    """Write a pack as the folder of a data set, and return the folder. Raises SettingError if the pack is private."""
    check_revealed(pack.name, is_private(pack.manifest.meta), "A folder of all episodes", reveals=False)
    folder = out / "datasets" / pack.name
    shutil.copytree(pack.folder, folder)
    shutil.copy(OPENENV, folder)
    title = f"VIGIL: {pack.name}"
    task = {"id": pack.name, "config": "episodes", "split": "train"}
    evaluation = {"name": title, "description": pack.manifest.description, "evaluation_framework": "inspect-ai"}
    _write_yaml(folder / "eval.yaml", {**evaluation, "tasks": [task]})
    frameworks = {
        "openenv": {"manifest": OPENENV.name, "mode": "space", "space_id": f"{owner}/vigil"},
        "verifiers": {"min_version": ">=0.4", "adapter": "vigil_verifiers.VigilTaskset"},
    }
    environment = {"id": pack.name, "title": title, "config_name": "episodes", "splits": ["train"]}
    environments = [{**environment, "frameworks": frameworks}]
    _write_yaml(folder / "environment.yaml", {"spec_version": "hf-env-0.1", "environments": environments})
    return folder


def write_register_entry(owner: str, repository: str, commit: str, out: Path) -> Path:
    """Write the entry for the register of Inspect Evals, and return its file."""
    path = out / "register" / "vigil" / "eval.yaml"
    path.parent.mkdir(parents=True)
    entry = {
        "id": "vigil",
        "full_title": "VIGIL: World Completion and Truthful Closing of Embodied Agents",
        "common_title": "VIGIL",
        "paper_title": PAPER,
        "description": DESCRIPTION,
        "arxiv": "https://arxiv.org/abs/2605.08747",
        "contributors": [owner],
        "tags": ["embodied agents", "vision-language models"],
        "tasks": [{"name": "vigil", "task_path": str(TASK)}],
        "source": {"repository_url": repository, "repository_commit": commit, "maintainers": [owner]},
    }
    _write_yaml(path, entry)
    return path


def write_leaderboard_results(site: Path, bundles: Sequence[Path], packs: Sequence[Path], out: Path) -> Iterator[str]:
    """Write the results of the bundles that are entries of a site, and yield a line for each bundle."""
    shown = {entry["id"] for entry in json.loads((site / "entries.json").read_text(encoding="utf-8"))["entries"]}
    known = known_packs(tuple(packs))
    for bundle in bundles:
        with tempfile.TemporaryDirectory() as work:
            try:
                metadata = unpack_bundle(bundle, Path(work)).metadata
                header = read_header(Path(work))
                if header.sha256[:ID_DIGITS] not in shown:
                    raise SettingError("It is not an entry of the site.")
                is_own = metadata.submitting_organization == metadata.model_organization
                publisher = Publisher(
                    organization=metadata.submitting_organization,
                    relationship="first_party" if is_own else "third_party",
                    developer=metadata.model_organization,
                )
                place = known.get(header.spec.pack_sha256)
                written = write_results([Path(work)], place, out / "every_eval_ever", publisher, lambda _: None)
                yield f"{bundle}: {written[0]}"
            except InputError as fault:
                yield f"{bundle}: left out. {fault}"


def _write_yaml(path: Path, content: dict[str, Any]) -> None:
    path.write_text(yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=100), encoding="utf-8")


def main() -> None:
    """Write the folders."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundles", nargs="*", type=Path, help="Bundles of entries of --site.")
    parser.add_argument("--owner", required=True, help="Name of the account or organization on the hubs.")
    parser.add_argument("--repository", required=True, help="Address of the public repository.")
    parser.add_argument("--commit", required=True, help="Full hash of the published commit.")
    parser.add_argument("--site", type=Path, help="Site of a leaderboard.")
    parser.add_argument("--pack", type=Path, action="append", default=[], help="Folder of another pack of the bundles.")
    parser.add_argument("--out", required=True, type=Path, help="New folder.")
    given = parser.parse_args()
    if given.out.exists():
        parser.error(f"--out {given.out} exists already. Choose a new folder.")
    if bool(given.bundles) != bool(given.site):
        parser.error("Give --site and bundles together.")
    for name in packaged_names():
        print(write_dataset_folder(Pack.load(name), given.owner, given.out))
    print(write_register_entry(given.owner, given.repository, given.commit, given.out))
    for line in write_leaderboard_results(given.site, given.bundles, given.pack, given.out) if given.site else ():
        print(line)


if __name__ == "__main__":
    main()
