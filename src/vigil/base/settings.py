"""Setting: the help, name and bounds of a value that users can set. `Annotated` attaches them to the value's type.

Each setting is declared once: as a field of a dataclass (`runner.settings.RunSettings`), or as an alias that several
dataclasses and commands share. The command line makes its options from the declarations. `check_settings` applies the
same bounds to values that come from Python.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import MISSING, dataclass, fields
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from vigil.base.exported import loaded
from vigil.errors import SettingError, did_you_mean


@dataclass(frozen=True, slots=True)
class Setting:
    """The name, help and bounds of a setting."""

    help: str
    """One line of help. For a switch that is on by default, the line says what happens if it is turned off."""
    name: str = ""
    """Name of the option, without the dashes; empty to use the name of the field."""
    other_name: str = ""
    """Second name of the option; empty if it has only one name."""
    minimum: float | None = None
    maximum: float | None = None
    metavar: str | None = None
    """Word that stands for the value in the help; None to use the name of the type."""
    unset: str | None = None
    """Text for the help: what happens if the value is None."""
    env: str | None = None
    """Environment variable that sets the value if the option is not given."""
    read: str | Callable[[Any], Any] | None = None
    """Function that parses the option's text, or a list of texts if the option `repeats`. Raises SettingError. The name
    "module:function" stands for a function whose large module is loaded only when the function is needed."""
    repeats: bool = False
    """Whether the option may be given several times. If so, `read` gets the list of all texts."""
    is_option: bool = True
    """Whether the command line has an option for the setting."""


@dataclass(frozen=True, slots=True)
class DeclaredSetting:
    """A setting with its name in Python, its type without `Annotated`, and its default (MISSING if there is none)."""

    name: str
    kind: Any
    setting: Setting
    default: Any = MISSING

    @property
    def option(self) -> str:
        """Name of the option, without the leading dashes."""
        return self.setting.name or self.name.replace("_", "-")

    @property
    def display_name(self) -> str:
        """Name of the setting in messages: its option, or its name in Python if it does not have an option."""
        return f"--{self.option}" if self.setting.is_option else f"Setting {self.name}"

    def value(self, given: Any) -> Any:
        """Return the setting's value, parsed from `given`. If `given` is None or an empty list, return the default.

        Raises SettingError.
        """
        if given is None or given == []:
            return self.default
        if self.setting.read is not None:
            return loaded(self.setting.read)(given)
        return tuple(given) if get_origin(self.kind) is tuple else given


class DefaultName(str):
    """A default text that can be distinguished from the same text given by the user."""

    __slots__ = ()


def declared_setting(name: str, annotation: Any, default: Any = MISSING) -> DeclaredSetting | None:
    """Return the setting that an annotation declares; None if the annotation does not declare a setting."""
    if get_origin(annotation) is not Annotated:
        return None
    kind, *notes = get_args(annotation)
    setting = next((note for note in notes if isinstance(note, Setting)), None)
    return None if setting is None else DeclaredSetting(name, kind, setting, default)


def declared_settings(settings: type) -> Iterator[DeclaredSetting]:
    """Yield the settings that a dataclass declares, in order. The annotations of its fields must not be strings."""
    for field in fields(settings):
        default = field.default if field.default_factory is MISSING else field.default_factory()
        found = declared_setting(field.name, field.type, default)
        if found is not None:
            yield found


def check_settings(settings: object) -> None:
    """Raise SettingError if a value in a settings dataclass violates the bounds or choices of its declaration."""
    for one in declared_settings(type(settings)):
        value = getattr(settings, one.name)
        if value is None:
            continue
        known = choices(one.kind)
        if known and value not in known:
            hint = did_you_mean(str(value), known)
            raise SettingError(f"{one.display_name} is {value!r}.{hint} Choose one of: {', '.join(known)}.")
        if not isinstance(value, int | float):
            continue
        minimum, maximum = one.setting.minimum, one.setting.maximum
        if not math.isfinite(value):
            raise SettingError(f"{one.display_name} is {value}; it must be a finite number.")
        if minimum is not None and value < minimum:
            raise SettingError(f"{one.display_name} is {value}; it must be {minimum} or more.")
        if maximum is not None and value > maximum:
            raise SettingError(f"{one.display_name} is {value}; it must be {maximum} or less.")


def choices(kind: Any) -> tuple[str, ...]:
    """Return the values that `kind` allows if it is a `Literal` or an optional `Literal`; () for any other type."""
    if get_origin(kind) in (Union, UnionType):
        return next((found for part in get_args(kind) if (found := choices(part))), ())
    return get_args(kind) if get_origin(kind) is Literal else ()
