"""Settings: declared once, and held against their declaration."""

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Annotated, Any, Literal

import pytest

from vigil.base.settings import Setting, check_settings, declared_settings
from vigil.errors import SettingError
from vigil.runner.settings import RunSettings
from vigil.runner.verify_run import VerifySettings
from vigil.web.play import PlaySettings


@dataclass(frozen=True)
class Some:
    """Settings of several kinds; `plain` declares nothing."""

    name: Annotated[str, Setting("A name.")]
    plain: float = float("nan")
    count: Annotated[int | None, Setting("How many.", minimum=1, maximum=9)] = None
    share: Annotated[float, Setting("How much.")] = 0.5
    kind: Annotated[Literal["round", "square"] | None, Setting("Which.")] = None
    more: Annotated[Mapping[str, Any], Setting("Else.")] = field(default_factory=lambda: {"a": 1})


def test_what_declares_a_setting_is_found_with_its_default() -> None:
    found = {one.name: one.default for one in declared_settings(Some)}
    assert found == {"name": MISSING, "count": None, "share": 0.5, "kind": None, "more": {"a": 1}}


@pytest.mark.parametrize("changes", [{}, {"count": 1}, {"count": 9}, {"share": -1e9}, {"kind": "round"}])
def test_values_within_their_bounds_pass(changes: dict[str, Any]) -> None:
    check_settings(Some("x", **changes))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"count": 0}, "--count is 0; it must be 1 or more."),
        ({"count": 10}, "--count is 10; it must be 9 or less."),
        ({"share": float("nan")}, "--share is nan; it must be a finite number."),
        ({"share": float("inf")}, "--share is inf; it must be a finite number."),
        ({"kind": "squar"}, "--kind is 'squar'. Did you mean 'square'? Choose one of: round, square."),
    ],
)
def test_values_out_of_their_bounds_are_named(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(SettingError) as caught:
        check_settings(Some("x", **changes))
    assert str(caught.value) == said


@pytest.mark.parametrize("settings", [RunSettings, VerifySettings, PlaySettings])
def test_values_are_checked_when_settings_are_made(settings: type) -> None:
    required = {one.name: "x" for one in declared_settings(settings) if one.default is MISSING}
    settings(**required)
    with pytest.raises(SettingError, match="limit is 0; it must be 1 or more"):
        settings(**required, limit=0)


def test_settings_from_python_alone_are_few() -> None:
    """Of all that a run takes, only what is no text, and the patience with servers and simulators, is no option."""
    offered = {one.name for one in declared_settings(RunSettings) if one.setting.is_option}
    assert {one.name for one in fields(RunSettings)} - offered == {
        *("agent_factory", "simulator_factory", "reveal_private_pack"),
        *("retries", "first_wait_s", "longest_wait_s", "timeout_s"),
    }
