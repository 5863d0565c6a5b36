"""`vigil pack perturb`: makes a pack whose episodes differ from those of another pack in one respect."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from vigil.base.settings import Setting
from vigil.cli.arguments import PackArgument
from vigil.cli.packs import load_pack
from vigil.cli.progress import progress
from vigil.packs.files import Change
from vigil.runner.shared_settings import AssetFile, Backend, Workers


def perturb(
    pack: PackArgument,
    change: Annotated[Change, Setting("What differs in the new pack.")],
    out: Annotated[Path, Setting("Folder for the new pack: new or empty.")],
    seed: Annotated[int, Setting("Seed of the changes. Other seeds give other packs.", minimum=0)] = 0,
    name: Annotated[str | None, Setting("Name of the new pack.", unset="PACK_CHANGE_SEED")] = None,
    workers: Workers = None,
    assets: AssetFile = None,
    backend: Backend = "mujoco",
) -> None:
    """Examples:
    vigil pack perturb vigil_mini --change wording --out packs/mini_wording
    vigil pack perturb vigil_mini --change start --seed 7 --out packs/mini_start

    wording: every instruction has another sentence form and names the same objects; if possible, the form is one that
    published packs do not use. start: every start is moved by 0.25 to 1 m and turned by at most 30 degrees. light: all
    lamps have another colour and strength.

    Each episode is certified again, and keeps the id of its original. Give `vigil report` the runs on both packs.
    """
    from vigil.authoring.packing.verify import VerificationSettings
    from vigil.authoring.perturbation.perturb import PerturbationSettings, perturb_pack
    from vigil.runner.workers.pool import worker_count

    loaded, database = load_pack(pack, assets)
    is_robust = bool(loaded.manifest.meta.get("is_robust"))
    checks = VerificationSettings(backend, database, worker_count(workers), is_robust)
    settings = PerturbationSettings(change, seed, loaded.manifest.suite, checks)
    with progress("houses") as show:
        made = perturb_pack(loaded, out, name or f"{loaded.name}_{change}_{seed}", settings, show)
    print(f"{out}: {len(made.episodes)} of {len(loaded.episodes)} episodes, sha256 {made.sha256}")
    found = made.manifest.perturbation
    for reason, count in () if found is None else found.left_out.items():
        print(f"left out: {reason} {count}")
