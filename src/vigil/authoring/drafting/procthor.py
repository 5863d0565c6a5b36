"""ProcTHOR-10K: houses of Ai2's dataset by split and index. The Python package `prior` downloads the dataset once.

    procthor-10k              the split train
    procthor-10k:val          another split
    procthor-10k:test:7       one house; indices are the dataset's, from 0
    procthor-10k:test:0-99    houses 0 to 99

The revision is fixed. `prior` would decode all splits; this module reads the files itself, so that only the wanted
houses are decoded.
"""

import re
import sys
from collections.abc import Callable
from contextlib import chdir, redirect_stdout
from pathlib import Path
from typing import Any, NamedTuple

from vigil.errors import SettingError, did_you_mean, shorten

DATASET, OWNER = "procthor-10k", "allenai"
REVISION = "439193522244720b86d8c81cde2e51e3a4d150cf"
"""Commit of the dataset. Its houses are for AI2-THOR 5.0 and later."""
FORM = f"{DATASET}[:SPLIT[:INDEX]], e.g. {DATASET}:val:7 or {DATASET}:val:0-99"
GZIP_MAGIC = b"\x1f\x8b"
MAX_REASON_CHARS = 200


SPLITS, MEGABYTES = {"train": 10_000, "val": 1_000, "test": 1_000}, 63
"""Split -> number of houses, and size of all files together in megabytes (both at `REVISION`)."""


class NamedHouses(NamedTuple):
    """Houses of the dataset to which a text refers."""

    split: str
    indices: range


def is_dataset(text: str) -> bool:
    """Return whether a text refers to houses of the dataset, not to a file."""
    return text.partition(":")[0] == DATASET


def named(text: str) -> NamedHouses:
    """Return the houses to which a text such as `procthor-10k:val:0-99` refers. Raises SettingError if invalid."""
    _, _, rest = text.partition(":")
    name, _, index = rest.partition(":")
    name = name if ":" in text else "train"
    if name not in SPLITS:
        hint = did_you_mean(f"{DATASET}:{name}", [f"{DATASET}:{split}" for split in SPLITS])
        raise SettingError(f"{text!r}: the dataset has no split {name!r}.{hint} Splits: {', '.join(SPLITS)}.")
    last = SPLITS[name] - 1
    if not text.count(":") > 1:
        return NamedHouses(name, range(last + 1))
    found = re.fullmatch(r"(\d{1,9})(?:-(\d{1,9}))?", index, re.ASCII)
    if found is None:
        raise SettingError(f"{text!r}: {index!r} is not an index. Houses are named by {FORM}.")
    low, high = int(found[1]), int(found[2] or found[1])
    if low > high or high > last:
        raise SettingError(
            f"{text!r}: split {name!r} has houses 0 to {last}, and the first number of a range must not be larger "
            "than the second."
        )
    return NamedHouses(name, range(low, high + 1))


def split_file(split: str, report: Callable[[str], None], revision: str = REVISION) -> Path:
    """Return the file with a split's houses, one per line. Download the dataset if it is missing.

    `report` gets a line that announces the download. Only the fixed revision is accepted, because `prior` runs code of
    the revision that it downloads. Raises SettingError for another revision, if `prior` is not installed, or if the
    download fails.
    """
    if revision != REVISION:
        raise SettingError(
            f"Revision {revision!r} of {DATASET} is not accepted: `prior` executes code of the revision that it "
            f"downloads, so this package accepts only {REVISION}. Give the houses as a file."
        )
    if split not in SPLITS:
        hint = did_you_mean(split, SPLITS)
        raise SettingError(f"{DATASET} has no split {split!r}.{hint} Splits: {', '.join(SPLITS)}.")
    prior = _prior()
    folder = Path(prior.DATASET_DIR) / OWNER / DATASET
    path = folder / revision / f"{split}.jsonl.gz"
    if not _is_downloaded(path):
        report(
            f"{DATASET}, revision {revision[:7]}, is downloaded once: about {MEGABYTES} MB from "
            f"github.com/{OWNER}/{DATASET}, by the package prior, with git and git-lfs, into {folder}."
        )
        _download(prior, folder, revision)
    if not _is_downloaded(path):
        raise SettingError(f"{str(path)!r} is missing or incomplete after the download. {_remedy(folder)}")
    return path


def _is_downloaded(path: Path) -> bool:
    """Return whether the file itself exists, not only the Git LFS pointer to it."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(len(GZIP_MAGIC)) == GZIP_MAGIC


def _download(prior: Any, folder: Path, revision: str) -> None:
    try:
        with chdir("."), redirect_stdout(sys.stderr):  # prior changes the folder, and does not return if it fails
            prior.load_dataset(DATASET, revision=revision, entity=OWNER)
    except Exception as error:  # prior does not catch what git, GitHub and the file system raise
        reason = shorten(f"{type(error).__name__} {error}".strip(), MAX_REASON_CHARS)
        raise SettingError(f"{DATASET} could not be downloaded ({reason}). {_remedy(folder)}") from error


def _remedy(folder: Path) -> str:
    return (
        f"Check that this machine reaches github.com and has git and git-lfs; or copy the folder {str(folder)!r} "
        "from a machine that has the dataset, which then needs no network."
    )


def _prior() -> Any:
    try:
        import prior  # noqa: PLC0415  # pyright: ignore[reportMissingImports] - an extra
    except ImportError:
        raise SettingError(
            f"{DATASET} is read with the Python package 'prior', which is not installed. Run: "
            'pip install "vigil-bench[procthor]"; or give a file of houses.'
        ) from None
    except KeyError:
        raise SettingError(f"{DATASET} is stored in ~/.prior, but the variable HOME is not set. Set it.") from None
    return prior
