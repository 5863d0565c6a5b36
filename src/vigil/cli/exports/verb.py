"""`vigil export`: writes runs as pages, films, tables, a dataset, or results in the format Every Eval Ever."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vigil.base.settings import Setting
from vigil.cli.arguments import Epoch
from vigil.cli.progress import read_runs_shown
from vigil.cli.text import print_notes
from vigil.errors import SettingError, check_known
from vigil.integrations.exports.options import Disclosure, Publisher
from vigil.runner.shared_settings import AssetFile

if TYPE_CHECKING:
    from vigil.analysis.measures.rows import Run

SITE, PARQUET, HF, EVERY_EVAL_EVER = "site", "parquet", "hf", "every-eval-ever"
FORMATS = (SITE, PARQUET, HF, EVERY_EVAL_EVER)


@dataclass(frozen=True, kw_only=True)
class ExportOptions:
    """What `vigil export` writes, and where to."""

    out: Annotated[
        Path,
        Setting(
            "Where to write: a new folder; with --episode, a file ending in .html, .gif, .webp or .mp4; "
            "with --format parquet, a file."
        ),
    ]
    form: Annotated[
        str,
        Setting(
            f"What to write: {SITE} (web pages of a run), {PARQUET} (a table of episodes), {HF} (a dataset "
            f"of steps), or {EVERY_EVAL_EVER} (results to share).",
            name="format",
        ),
    ] = SITE
    episode: Annotated[
        str | None,
        Setting("Id of one episode: only this episode is exported, as a page or a film.", unset="all episodes"),
    ] = None
    pack: Annotated[
        tuple[str, ...],
        Setting(
            "Pack on which the run was played, as folder or name; needed if the pack's folder has moved.",
            unset="the pack that the run recorded",
        ),
    ] = ()
    assets: AssetFile = None
    reasoning: Annotated[
        bool, Setting("Also export the model's reasoning that the run saved; for --format hf only.")
    ] = False


def export(
    runs: Annotated[
        list[Path], typer.Argument(help="Folders of the runs to export; the format site takes only one run.")
    ],
    options: ExportOptions,
    epoch: Epoch = 1,
    *,
    publisher: Publisher,
    disclosure: Disclosure,
) -> None:
    """Examples:
    vigil export runs/solver --out site
    vigil export runs/solver --episode procthor_fridge_seed116 --out fridge.gif
    vigil export runs/a runs/b --format parquet --out episodes.parquet
    vigil export runs/a runs/b --format hf --out dataset
    vigil export runs/a runs/b --format every-eval-ever --organization "My lab" --out datastore
    """
    from vigil.cli.exports.site import write_run_site
    from vigil.integrations.exports.dataset import write_dataset
    from vigil.integrations.exports.every_eval_ever.folder import write_results

    form, out, episode = options.form, options.out, options.episode
    _check_place(form, out)
    _check_options(form, publisher, disclosure, reasoning=options.reasoning)
    if form == SITE:
        if len(runs) > 1:
            raise SettingError(f"A site shows one run, but {len(runs)} were given. Give one run, or another --format.")
        key = None if episode is None else (episode, epoch)
        reveals = disclosure.reveal_private_pack
        print(write_run_site(runs[0], out, key, options.pack, options.assets, reveals=reveals))
        return
    if episode is not None:
        raise SettingError(
            "--episode exports a page or a film. Leave out --format, and give an --out that ends in .html or .gif."
        )
    place = _only_pack(options.pack)
    if form == EVERY_EVAL_EVER:
        for path in write_results(runs, place, out, publisher, print_notes, disclosure):
            print(path)
        return
    found = read_runs_shown(runs, place)
    print_notes(fault for run in found for fault in run.faults)
    if form == PARQUET:
        print(_write_rows(found, out, disclosure))
    else:
        print(write_dataset(found, place, out, disclosure, with_reasoning=options.reasoning))


def _write_rows(runs: "list[Run]", out: Path, disclosure: Disclosure) -> Path:
    from vigil.analysis.measures.rows import combined_rows
    from vigil.integrations.exports.dataset import check_rows

    check_rows(runs, disclosure)
    combined_rows(runs).to_parquet(out, index=False)
    return out


def _check_options(format_: str, publisher: Publisher, disclosure: Disclosure, *, reasoning: bool) -> None:
    """Raise SettingError if an option that was given is for other formats."""
    if format_ != EVERY_EVAL_EVER and publisher != Publisher():
        raise SettingError(
            f"{publisher.given} is for --format {EVERY_EVAL_EVER} only. Leave it out, or change --format."
        )
    if reasoning and format_ != HF:
        raise SettingError(f"--reasoning is for --format {HF} only. Leave it out, or change --format.")
    if disclosure.answer_key and format_ not in (HF, EVERY_EVAL_EVER):
        raise SettingError(
            f"--answer-key is for --format {HF} and {EVERY_EVAL_EVER}: the other formats always include the answer key."
        )


def _check_place(format_: str, out: Path) -> None:
    """Raise SettingError if the format does not exist or cannot be written to `out`."""
    check_known("Format", format_, FORMATS)
    if not out.absolute().parent.is_dir():
        raise SettingError(f"--out {str(out)!r}: folder {str(out.parent)!r} does not exist. Make it first.")
    if format_ == PARQUET and out.suffix != ".parquet":
        raise SettingError(
            f"--out {str(out)!r}: --format {PARQUET} writes one file. Give a name that ends in .parquet."
        )
    if format_ in (HF, EVERY_EVAL_EVER) and out.exists() and not out.is_dir():
        raise SettingError(f"--out {str(out)!r} is a file, but --format {format_} writes a folder. Give another --out.")


def _only_pack(packs: Sequence[str]) -> str | None:
    if len(packs) > 1:
        raise SettingError(
            "--pack may be given several times only with --format site. Give one --pack, and only runs on this pack."
        )
    return packs[0] if packs else None
