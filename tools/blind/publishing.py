"""Publishes blind rounds: every picture with its contents and its answer, and the shares of right answers.

Files are named round_N_KIND.jsonl, one picture a line; those of things and starts name the renderer.
"""

import json
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from tools.blind.forms import (
    LAYOUTS,
    ArtefactsAnswer,
    DrawnBy,
    HeldAnswer,
    NamedAnswer,
    RoundAnswer,
    RoundKind,
    VoteAnswer,
)
from tools.blind.judging import is_named, is_state_named
from tools.blind.sheets import ANSWERS, SIDES, key_of, write_lines
from vigil.scoring.rates import wilson

FOLDER = Path(__file__).parents[2] / "docs" / "blind"
RENDERERS: tuple[DrawnBy, ...] = ("before", "after")
JsonRow = dict[str, Any]


@dataclass(frozen=True, slots=True)
class AnsweredRound:
    """A round with its answers."""

    kind: RoundKind
    rows: list[JsonRow]
    """Pictures with their answers, in the order of their numbers."""


def publish(folders: Sequence[Path], out: Path, number: int | None = None) -> str:
    """Write the rows of rounds to `out`. Return a report of them in Markdown: shares, and what was not right.

    Raises SystemExit when an answer is missing or not understood, or a file of that number is there already.
    """
    rounds = [read(folder) for folder in folders]
    files: dict[str, list[JsonRow]] = defaultdict(list)
    number = number or _next_number(out)
    for one in rounds:
        for row in one.rows:
            files[_file_name(number, one.kind, row)].append(row)
    there = [name for name in files if (out / name).exists()]
    if there:
        raise SystemExit(f"{', '.join(sorted(there))} is in {str(out)!r} already; give another --number.")
    out.mkdir(parents=True, exist_ok=True)
    for name, rows in files.items():
        write_lines(out / name, rows)
    return report(number, rounds)


def _next_number(out: Path) -> int:
    found = [re.match(r"round_(\d+)_?", path.name) for path in out.glob("round_*.jsonl")]
    return 1 + max((int(match[1]) for match in found if match), default=0)


def _file_name(number: int, kind: RoundKind, row: JsonRow) -> str:
    name = {"starts": "artefacts", "pairs": "vote"}.get(kind, kind)
    drawn = f"_{row['drawn']}" if LAYOUTS[kind].answer is NamedAnswer else ""
    return f"round_{number}_{name}{drawn}.jsonl"


def read(folder: Path) -> AnsweredRound:
    """Return a round's pictures with their answers. Raises SystemExit when one has none, or one is not understood."""
    key = json.loads(key_of(folder).read_text(encoding="utf-8"))
    answers = _answers(folder / ANSWERS, LAYOUTS[key["kind"]].answer)
    numbers = {picture["n"] for picture in key["pictures"]}
    if numbers != set(answers):
        odd = sorted(numbers ^ set(answers))
        raise SystemExit(f"{folder / ANSWERS}: pictures {odd} are asked for or answered, not both.")
    made_row = _ROWS[LAYOUTS[key["kind"]].answer]
    return AnsweredRound(key["kind"], [made_row(key, picture, answers[picture["n"]]) for picture in key["pictures"]])


def _answers(path: Path, form: type[RoundAnswer]) -> dict[int, RoundAnswer]:
    found: dict[int, RoundAnswer] = {}
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        if not line.strip():
            continue
        try:
            answer = form.model_validate_json(line)
        except ValidationError as error:
            raise SystemExit(f"{path}, line {number}: {error}") from None
        if answer.n in found:
            raise SystemExit(f"{path}, line {number}: picture {answer.n} is answered twice.")
        found[answer.n] = answer
    return found


def _named(key: JsonRow, picture: JsonRow, answer: NamedAnswer) -> JsonRow:
    state = picture["state"]
    return {
        "seed": key["seed"],
        "drawn": key["drawn"],
        **{name: picture[name] for name in ("category", "variant", "state", "span_px")},
        "answers": answer.answers,
        "state_answer": answer.state,
        "right": is_named(picture["category"], answer.answers[0]),
        "state_right": None if state is None else is_state_named(state, answer.state),
    }


def _held(key: JsonRow, picture: JsonRow, answer: HeldAnswer) -> JsonRow:
    facts = {name: picture[name] for name in ("episode", "quality", "held")}
    return {"seed": key["seed"], **facts, "answer": answer.held, "what": answer.what}


def _artefacts(key: JsonRow, picture: JsonRow, answer: ArtefactsAnswer) -> JsonRow:
    facts = {name: picture[name] for name in ("episode", "drawn")}
    return {"seed": key["seed"], **facts, "artefacts": answer.artefacts}


def _vote(key: JsonRow, picture: JsonRow, answer: VoteAnswer) -> JsonRow:
    left = picture["left"]
    drawn = dict(zip(SIDES, (left, *(name for name in RENDERERS if name != left)), strict=True))
    facts = {"episode": picture["episode"], "left": left}
    chosen = {"more_real": drawn[answer.more_real], "clearer": drawn[answer.clearer]}
    return {"seed": key["seed"], **facts, **chosen, "why": answer.why}


_ROWS: dict[type[RoundAnswer], Callable[[JsonRow, JsonRow, Any], JsonRow]] = {
    NamedAnswer: _named,
    HeldAnswer: _held,
    ArtefactsAnswer: _artefacts,
    VoteAnswer: _vote,
}


def report(number: int, rounds: Iterable[AnsweredRound]) -> str:
    """Return tables of the shares of rounds, and lists of what was not right, in Markdown."""
    rows: dict[tuple[RoundKind, str], list[JsonRow]] = defaultdict(list)
    for one in rounds:
        for row in one.rows:
            rows[one.kind, row.get("drawn", "")].append(row)
    parts = []
    named = {group: found for group, found in rows.items() if LAYOUTS[group[0]].answer is NamedAnswer}
    if named:
        lines = [_things(number, *group, found) for group, found in named.items()]
        parts.append("\n".join(["| round | shown | named right | states told right |", "|---|---|---|---|", *lines]))
        parts += [misses for group, found in named.items() if (misses := _misses(*group, found))]
    others = [line for group, found in rows.items() if group not in named for line in _shares(*group, found)]
    if others:
        parts.append("\n".join(["| asked | answers |", "|---|---|", *others]))
    return "\n\n".join(parts)


def share(hits: int, n: int) -> str:
    """Return a share with its 95 % Wilson interval, e.g. `38 of 40 (95.0 % [83.5, 98.6])`."""
    low, high = wilson(hits, n)
    return f"{hits} of {n} ({100 * hits / max(n, 1):.1f} % [{100 * low:.1f}, {100 * high:.1f}])"


def _things(number: int, kind: RoundKind, drawn: str, rows: Sequence[JsonRow]) -> str:
    state_results = [row["state_right"] for row in rows if row["state_right"] is not None]
    shares = share(sum(row["right"] for row in rows), len(rows)), share(sum(state_results), len(state_results))
    return f"| {number}, {kind}, {drawn} | {len(rows)} pictures | {shares[0]} | {shares[1]} |"


def _misses(kind: RoundKind, drawn: str, rows: Sequence[JsonRow]) -> str:
    """Return a list of wrong answers; empty when all were right."""
    lines = []
    for row in rows:
        shown = f"- {kind}, {drawn}: {row['category']} {row['variant']}"
        if not row["right"]:
            lines.append(f"{shown}: named {', then '.join(map(repr, row['answers']))}")
        if row["state_right"] is False:
            lines.append(f"{shown}: {row['state']}, told {row['state_answer']!r}")
    return "\n".join(lines)


def _shares(kind: RoundKind, drawn: str, rows: Sequence[JsonRow]) -> list[str]:
    n = len(rows)
    if kind == "held":
        return [f"| held or not? | right in {share(sum(row['held'] == row['answer'] for row in rows), n)} |"]
    if kind == "starts":
        return [f"| single frames, {drawn}: artefacts? | in {share(sum(bool(row['artefacts']) for row in rows), n)} |"]
    return [
        f"| pairs: which {asked}? | after in {share(sum(row[name] == 'after' for row in rows), n)} |"
        for name, asked in (("more_real", "looks more real"), ("clearer", "is clearer"))
    ]
