"""Options of the command line, made from the settings that verbs declare."""

import functools
import inspect
from collections.abc import Callable, Iterator
from dataclasses import MISSING, is_dataclass
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

import typer

from vigil.base.settings import DeclaredSetting, DefaultName, declared_setting, declared_settings

Function = Callable[..., None]


def with_options(verb: Function) -> Function:
    """Return a verb's function with a signature that Typer can read.

    If the type of a parameter is a dataclass of settings, each of its settings becomes an option. A parameter that
    declares a `Setting` becomes an option. Typer's own options and arguments stay as they are. A setting that is on by
    default gets the option `--no-NAME`.
    """
    parameters = inspect.signature(verb, eval_str=True).parameters
    groups = {
        name: [one for one in declared_settings(each.annotation) if one.setting.is_option]
        for name, each in parameters.items()
        if isinstance(each.annotation, type) and is_dataclass(each.annotation)
    }

    @functools.wraps(verb)
    def call(**texts: Any) -> None:
        values = {}
        for name, parameter in parameters.items():
            if name in groups:
                given = {one.name: _value(one, texts.pop(one.name)) for one in groups[name]}
                values[name] = parameter.annotation(**given)
            else:
                one = _own(parameter)
                values[name] = texts.pop(name) if one is None else _value(one, texts.pop(name))
        verb(**values)

    flat = [one for each in parameters.values() for one in _parameters(each, groups.get(each.name))]
    call.__signature__ = inspect.Signature(flat)  # pyright: ignore[reportAttributeAccessIssue]
    call.__annotations__ = {one.name: one.annotation for one in flat}
    return call


def _own(parameter: inspect.Parameter) -> DeclaredSetting | None:
    default = MISSING if parameter.default is parameter.empty else parameter.default
    return declared_setting(parameter.name, parameter.annotation, default)


def _parameters(parameter: inspect.Parameter, group: list[DeclaredSetting] | None) -> Iterator[inspect.Parameter]:
    """Yield the parameters that Typer sees in place of `parameter`."""
    one = _own(parameter)
    if group is None and one is None:
        yield parameter.replace(kind=parameter.KEYWORD_ONLY)
    for each in group or filter(None, [one]):
        annotation = Annotated[_text_type(each), _option(each)]
        default = parameter.empty if each.default is MISSING else _shown(each)
        yield inspect.Parameter(each.name, parameter.KEYWORD_ONLY, annotation=annotation, default=default)


def _option(one: DeclaredSetting) -> Any:
    setting = one.setting
    return typer.Option(
        f"--no-{one.option}" if one.default is True else f"--{one.option}",
        *([f"--{setting.other_name}"] if setting.other_name else []),
        help=setting.help,
        min=setting.minimum,
        max=setting.maximum,
        metavar=setting.metavar,
        envvar=setting.env,
        show_default=setting.unset or (str(one.default) if isinstance(one.default, DefaultName) else True),
    )


def _text_type(one: DeclaredSetting) -> Any:
    """Return the type to which Typer converts an option's texts."""
    if one.setting.read is not None:
        return list[str] | None if one.setting.repeats else str | None
    kinds = get_args(one.kind) if get_origin(one.kind) in (Union, UnionType) else (one.kind,)
    kind = next(kind for kind in kinds if kind is not type(None))
    if get_origin(kind) is tuple:
        return list[get_args(kind)[0]] | None
    return kind | None if type(None) in kinds or isinstance(one.default, DefaultName) else kind


def _shown(one: DeclaredSetting) -> Any:
    """Return the default that the help shows and Typer fills in."""
    if one.default is True:
        return False
    is_collection = one.setting.read is not None or get_origin(one.kind) is tuple
    return None if is_collection or isinstance(one.default, DefaultName) else one.default


def _value(one: DeclaredSetting, given: Any) -> Any:
    """Return the setting's value from the value that Typer read."""
    return not given if one.default is True and given is not None else one.value(given)
