"""Options are made from declared settings, and settings from what was typed."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
import typer
from typer.testing import CliRunner, Result

from vigil.base.settings import DefaultName, Setting
from vigil.cli import app
from vigil.cli.options import with_options
from vigil.errors import SettingError
from vigil.protocol.families import FAMILIES
from vigil.records.costs import Prices
from vigil.records.record import Shard
from vigil.runner.settings import RunSettings

USUAL = DefaultName("usual")


@dataclass(frozen=True)
class Some:
    """Settings of every kind."""

    count: Annotated[int, Setting("How many.", minimum=1, maximum=9)] = 3
    share: Annotated[float | None, Setting("How much.", unset="all of it")] = None
    place: Annotated[str | Path, Setting("Where.", name="at", env="SOME_PLACE")] = "here"
    kind: Annotated[Literal["round", "square"] | None, Setting("Which.")] = None
    words: Annotated[tuple[str, ...], Setting("Each.", name="word", other_name="term")] = ()
    sum: Annotated[int, Setting("Added up.", read=lambda texts: sum(map(int, texts)), repeats=True)] = 7
    size: Annotated[Mapping[str, int], Setting("Its length.", read=lambda text: {text: len(text)})] = field(
        default_factory=dict
    )
    mark: Annotated[str | Path, Setting("A mark.")] = USUAL
    is_bold: Annotated[bool, Setting("Bold.", name="bold")] = False
    is_safe: Annotated[bool, Setting("Take no care.", name="care")] = True
    hidden: Annotated[int, Setting("Of no option.", is_option=False)] = 5
    plain: int = 6


def typed(*words: str, env: dict[str, str] | None = None) -> tuple[Result, list[Any]]:
    """Return the result of a verb, and the arguments with which it was called."""
    called: list[Any] = []

    def verb(
        first: Annotated[str, typer.Argument()],
        some: Some,
        last: Annotated[int | None, Setting("Last.", minimum=0)] = None,
    ) -> None:
        called.extend([first, some, last])

    one = typer.Typer()
    one.command()(with_options(verb))
    return CliRunner().invoke(one, list(words), env=env), called


def test_defaults_are_those_of_the_declaration() -> None:
    assert typed("a")[1] == ["a", Some(), None]


def test_what_is_typed_arrives() -> None:
    words = "a --count 9 --share -0.5 --at there --kind square --word x --term y --sum 1 --sum 2 --size abc --bold"
    some = Some(9, -0.5, "there", "square", ("x", "y"), 3, {"abc": 3}, is_bold=True, is_safe=False)
    assert typed(*words.split(), "--no-care", "--last", "0")[1] == ["a", some, 0]


def test_a_marked_default_differs_from_the_same_text() -> None:
    unset, given = (typed(*words)[1][1].mark for words in (("a",), ("a", "--mark", "usual")))
    assert (unset, type(unset)) == (given, DefaultName)
    assert type(given) is str


def test_a_variable_sets_what_no_option_does() -> None:
    env = {"SOME_PLACE": "yonder"}
    assert typed("a", env=env)[1][1] == Some(place="yonder")
    assert typed("a", "--at", "there", env=env)[1][1] == Some(place="there")


@pytest.mark.parametrize(
    "words",
    [
        *("--count 0", "--count 10", "--count x", "--kind flat", "--last -1", "--hidden 1", "--plain 1"),
        *("--care", "--no-bold", "--place there", "--words x"),
    ],
)
def test_what_is_not_declared_is_refused(words: str) -> None:
    done, called = typed("a", *words.split())
    assert (done.exit_code, called) == (2, [])
    assert words.split()[0].strip("-") in done.output


def test_the_help_says_what_is_declared() -> None:
    shown = " ".join(typed("--help")[0].output.replace("│", " ").split())
    for words in (
        "How many.",
        "1<=x<=9",
        "[default: 3]",
        "(all of it)",
        "(usual)",
        "SOME_PLACE",
        "--no-care Take no care.",
    ):
        assert words in shown.replace("<bool> ", "")


@pytest.fixture
def played(monkeypatch: pytest.MonkeyPatch) -> list[RunSettings]:
    """The settings of the runs that would have been played."""
    settings: list[RunSettings] = []

    def plan(asked: RunSettings) -> None:
        settings.append(asked)
        raise typer.Exit

    monkeypatch.setattr("vigil.runner.plan.plan_run", plan)
    return settings


def test_a_run_takes_every_option(played: list[RunSettings]) -> None:
    words = (
        "run --agent noop --pack starter --log-dir r --limit 5 --family sm,PG --family da --episode a --episode b "
        "--workers 3 --max-connections 4 --profile action_feedback --prompt-variant neutral_report "
        "--coordinates normalized_1000 --reply-policy lenient --epochs 2 --image-format jpeg --render-quality fast "
        "--save-frames --backend fake --assets a.json --reply-seconds 3 --seed 4 --no-preflight --shard 2/3 "
        "--frame-interval-seconds 0.25 --keep-program"
    )
    assert CliRunner().invoke(app, words.split()).exit_code == 0
    assert played == [
        RunSettings(
            agent="noop", log_dir=Path("r"), limit=5, families=("PG", "DA", "SM"), episode_ids=("a", "b"), workers=3,
            max_connections=4, profile="action_feedback", prompt_variant="neutral_report",
            coordinates="normalized_1000", reply_policy="lenient", epochs=2, image_format="jpeg",
            render_quality="fast", save_frames=True, backend="fake", asset_database=Path("a.json"), reply_seconds=3,
            frame_interval_seconds=0.25, keep_program=True, seed=4, preflight=False, shard=Shard(index=2, of=3),
        )
    ]  # fmt: skip


def test_a_run_of_a_model_takes_every_option(played: list[RunSettings]) -> None:
    words = (
        "run --model openai/x --base-url http://h:1/v1 --api-key-env K --temperature -0.5 --top-p 0.3 --max-tokens 7 "
        "--reasoning-effort xhigh --prices 2.5,10 --model-arg a=1 --model-arg b=[1] --model-arg c=d --extra-body"
    )
    assert CliRunner().invoke(app, [*words.split(), '{"top_k": 20}']).exit_code == 0
    assert played == [
        RunSettings(
            model="openai/x", base_url="http://h:1/v1", api_key_env="K", temperature=-0.5, top_p=0.3, max_tokens=7,
            reasoning_effort="xhigh", prices=Prices(input=2.5, output=10), model_args={"a": 1, "b": [1], "c": "d"},
            extra_body={"top_k": 20},
        )
    ]  # fmt: skip


@pytest.mark.parametrize("verb", [["run", "--agent", "noop"], ["play", "--player", "ada"]], ids=lambda verb: verb[0])
def test_families_are_read_alike(verb: list[str]) -> None:
    done = CliRunner().invoke(app, [*verb, "--family", "PG,XY"])
    assert isinstance(done.exception, SettingError)
    assert str(done.exception) == f"Family 'XY' does not exist. The families: {', '.join(FAMILIES)}."
