"""Plays scripted and limited agents on a pack, submits each run, and builds the site of a leaderboard from them.

python -m tools.first_entries --pack mini --out build/leaderboard
"""

import argparse
from datetime import UTC, datetime
from pathlib import Path

from vigil.authoring.solving.flawed.ablated_solvers import ABLATIONS
from vigil.cli.runs import with_agent
from vigil.leaderboard.build import build_site
from vigil.leaderboard.metadata import EntryMetadata, Methodology, Verification
from vigil.leaderboard.settings import BuildSettings, CheckSettings
from vigil.leaderboard.submit import submit_run
from vigil.runner.plan import plan_run
from vigil.runner.run import play_run
from vigil.runner.settings import RunSettings

AGENTS = {
    "always_success": "Reports success at once.",
    "coin": "Reports success or failure at once, by chance.",
    **{name: f"Sees hidden state, with a limit: it {each.description}." for name, each in ABLATIONS.items()},
    "solver": "Sees hidden state: an upper bound, not a model.",
}


def main() -> None:
    """Play, submit and build."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pack", default="mini")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--workers", type=int)
    options = parser.parse_args()
    bundles: list[Path] = []
    for agent, notes in AGENTS.items():
        run, bundle = options.out / "runs" / agent, options.out / f"{agent}.zip"
        settings = RunSettings(pack=options.pack, agent=agent, log_dir=run, workers=options.workers)
        play_run(plan_run(with_agent(settings)))
        if not bundle.exists():
            submit_run(run, metadata_of(agent, notes), bundle, CheckSettings(workers=options.workers))
        bundles.append(bundle)
        print(bundle, flush=True)
    built = build_site(bundles, options.out / "site", BuildSettings(workers=options.workers))
    for line in built.log:
        print(line.bundle, line.status, line.why)


def metadata_of(agent: str, notes: str) -> EntryMetadata:
    """Return the metadata of an agent that comes with VIGIL."""
    today = datetime.now(UTC).date()
    us = "The VIGIL authors"
    return EntryMetadata(
        model_name=agent,
        model_organization=us,
        submitting_organization=us,
        submission_date=today,
        submission_type="custom",
        contact_info="issues of the repository",
        references=(),
        model_release=None,
        weights="none",
        trained_on_streams=False,
        tier="re_simulated",
        methodology=Methodology(
            evaluation_date=today,
            notes=notes,
            verification=Verification(modified_prompts=False, omitted_questions=False),
        ),
    )


if __name__ == "__main__":
    main()
