"""Makes the first entries of a leaderboard, and builds its site.

python -m tools.first_entries --out build/leaderboard

Scripted agents and agents with limits play a pack. The plays by readers in docs/packs/plays are added: as an entry if
they can be played again, otherwise as a line of the history. If a group of readers' plays is a part of its pack, its
entry is on a pack of just these episodes. A second call continues with what is in the folder.
"""

import argparse
import json
from datetime import date
from pathlib import Path

from tools.published_plays import publish_plays
from vigil.authoring.solving.flawed.ablated_solvers import ABLATIONS
from vigil.base.versions import Versions
from vigil.cli.runs import with_agent
from vigil.errors import RecordError
from vigil.packs.pack import Pack
from vigil.records.record import read_header
from vigil.runner.plan import plan_run
from vigil.runner.run import play_run
from vigil.runner.settings import RunSettings
from vigil.scoring.saved_run import SavedRun, read_run
from vigil.web.leaderboard.build import build_site
from vigil.web.leaderboard.measures import RANKED_BY, figure_text, measures_of
from vigil.web.leaderboard.metadata import EntryMetadata, Methodology, StatedFacts, read_metadata
from vigil.web.leaderboard.settings import BuildSettings, CheckSettings
from vigil.web.leaderboard.submit import submit_run

PACKS = Path(__file__).parents[1] / "docs" / "packs"
PLAYS, READERS = PACKS / "plays", PACKS / "readers.yaml"
NOT_ENTRIES = ("vigil_mini_v4",)
"""Groups of plays that are only in the history: 77 of these 80 plays are in `vigil_mini_v5` too, so that one of the two
would be refused as a copy."""
AGENTS = {
    "always_success": "Reports success at once.",
    "always_fail": "Reports failure at once.",
    "coin": "Reports success or failure at once, by chance.",
    "random": "Moves, looks, clicks and reports by chance.",
    "explore": "Walks and looks around by a fixed list of actions, then reports success.",
    **{name: f"Sees hidden state, with a limit: it {each.description}." for name, each in ABLATIONS.items()},
    "solver": "Sees hidden state: an upper bound, not a model.",
}


def main() -> None:
    """Play, submit and build."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pack", default="vigil_mini", help="Pack that the agents play (default: %(default)s).")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--workers", type=int)
    options = parser.parse_args()
    (options.out / "bundles").mkdir(parents=True, exist_ok=True)
    check = CheckSettings(workers=options.workers)
    bundles: list[Path] = []
    packs: list[Path] = []
    history: list[dict[str, str]] = []
    for agent, notes in AGENTS.items():
        run = options.out / "runs" / agent
        play_run(plan_run(with_agent(RunSettings(pack=options.pack, agent=agent, log_dir=run, workers=check.workers))))
        bundles.append(_submitted(run, metadata_of(agent, notes), options.out, check))
    for folder in sorted(PLAYS.iterdir()):
        saved = read_run(folder)
        pack = Pack.load(saved.pack_folder)
        metadata = read_metadata(READERS)
        is_entry = saved.header.spec.versions == Versions.current() and folder.name not in NOT_ENTRIES
        if is_entry:
            run, place = _with_own_pack(saved, pack, options.out / "runs" / folder.name)
            try:
                bundles.append(_submitted(run, metadata, options.out, check, place))
                packs.append(place)
            except RecordError as error:  # e.g. the profile's prompt had another text
                print(error, flush=True)
                is_entry = False
        if not is_entry or len(pack.episodes) > len(saved.header.spec.episode_ids):
            history.append(_history_row(saved, pack, metadata))
    earlier = options.out / "earlier.json"
    earlier.write_text(json.dumps({"history": history}))
    settings = BuildSettings(workers=options.workers, packs=tuple(packs), earlier=earlier)
    for line in build_site(bundles, options.out / "site", settings).log:
        print(line.bundle, line.status, line.why)


def _submitted(
    run: Path, metadata: EntryMetadata, out: Path, settings: CheckSettings, pack: Path | None = None
) -> Path:
    """Return the bundle of a run, which is made unless it exists. The dates of the entry are those of the run."""
    bundle = out / "bundles" / f"{run.name}.zip"
    header = read_header(run)
    day = (header.ended or header.started).date()
    methodology = metadata.methodology.model_copy(update={"evaluation_date": day})
    metadata = metadata.model_copy(update={"submission_date": day, "methodology": methodology})
    if not bundle.exists():
        submit_run(run, metadata, bundle, settings, pack=pack)
    print(bundle, flush=True)
    return bundle


def _with_own_pack(saved: SavedRun, pack: Pack, folder: Path) -> tuple[Path, Path]:
    """Return a run with all episodes of its pack, and the pack's folder: the run itself, or a copy of it in `folder`
    on a pack of its episodes."""
    if len(pack.episodes) == len(saved.header.spec.episode_ids):
        return saved.folder, pack.folder
    if not folder.exists():
        records = [saved.table.record(key) for key in sorted(saved.table.rows)]
        publish_plays(folder, pack.folder, records, saved.header)
    return folder, folder / "pack"


def _history_row(saved: SavedRun, pack: Pack, metadata: EntryMetadata) -> dict[str, str]:
    """Return the result of a run that is no entry on its whole pack, as a row of the site's history."""
    figure, spec = RANKED_BY[pack.manifest.suite], saved.header.spec
    whole = pack.manifest.meta.get("excerpt_of", {}).get("name", pack.name)
    shown = figure_text(figure, measures_of(saved, pack).figures[figure])
    return {
        "model_name": metadata.model_name,
        "profile": spec.profile.name,
        "pack": whole,
        "result": f"{shown} on {len(spec.episode_ids)} episodes, rules {spec.versions.rules}",
    }


def metadata_of(agent: str, notes: str) -> EntryMetadata:
    """Return the metadata of an agent that comes with VIGIL; its dates are replaced by the run's."""
    us = "The VIGIL authors"
    return EntryMetadata(
        model_name=agent,
        model_organization=us,
        submitting_organization=us,
        submission_date=date.min,
        submission_type="custom",
        contact_info="issues of the repository",
        references=(),
        model_release=None,
        weights="none",
        trained_on_streams=False,
        tier="re_simulated",
        methodology=Methodology(
            evaluation_date=date.min,
            notes=notes,
            verification=StatedFacts(modified_prompts=False, omitted_questions=False),
        ),
    )


if __name__ == "__main__":
    main()
