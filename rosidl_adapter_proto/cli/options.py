"""The options that several commands share."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from datetime import datetime
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

import click
from click.core import ParameterSource

from rosidl_adapter_proto.errors import Error, RequestError
from rosidl_adapter_proto.generate import Options
from rosidl_adapter_proto.generate.request import find_catalog
from rosidl_adapter_proto.generate.settings import SETTINGS, Kind, Setting, check_lock_file_is_used
from rosidl_adapter_proto.interfaces import store
from rosidl_adapter_proto.time import to_nanoseconds

Command = TypeVar("Command", bound=Callable[..., Any])


def complete_distro(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Return the distributions that begin with what was typed."""
    return [name for name in store.distributions() if name.startswith(incomplete)]


def complete_name(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Return the packages, or behind a slash the types of one, that begin with what was typed."""
    try:
        catalog = find_catalog(context.params.get("include") or (), context.params.get("distro"))
    except Error:
        return []
    package, slash, _ = incomplete.partition("/")
    names = map(str, catalog.packages.get(package, ())) if slash else catalog.packages
    return sorted(name for name in names if name.startswith(incomplete))


def complete_topic(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Return the topics that begin with what was typed, of the bag that stands before it."""
    from rosidl_adapter_proto.bags.bag import open_bag

    # Behind an option that waits for its value, click leaves the arguments where it found them.
    places = [context.params.get("bag"), *(context.params.get("places") or context.args)]
    try:
        return [name for name in open_bag(next(filter(None, places))).topics if name.startswith(incomplete)]
    except (StopIteration, Error):
        return []


_COMPLETIONS = {"distro": complete_distro}
_PATH = click.Path(path_type=Path)
_TYPES: dict[Kind, Any] = {
    Kind.FLAG: bool,
    Kind.TEXT: str,
    Kind.PATH: _PATH,
    Kind.NAMES: str,
    Kind.PATHS: _PATH,
}


def setting_option(name: str) -> Callable[[Command], Command]:
    """Return the decorator that gives a command the option of a setting."""
    setting = SETTINGS[name]
    is_flag = setting.kind is Kind.FLAG
    declarations = [f"--{name}/--no-{name}" if is_flag else f"--{name}"]
    if setting.short:
        declarations.append(f"-{setting.short}")
    return click.option(
        *declarations,
        type=click.Choice(setting.choices) if setting.choices else _TYPES[setting.kind],
        default=setting.default,
        multiple=setting.kind in (Kind.NAMES, Kind.PATHS),
        show_default=not is_flag and setting.default is not None,
        metavar=setting.metavar,
        help=setting.help,
        shell_complete=_COMPLETIONS.get(name),
    )


def source_options(command: Command) -> Command:
    """Add the options that say where definitions come from."""
    return setting_option("include")(setting_option("distro")(command))


def bag_source_options(command: Command) -> Command:
    """Add the options that say where definitions come from that a bag does not have."""
    setting = SETTINGS["include"]
    names = ("--include", "--interfaces", "-I")
    include = click.option(*names, "include", type=_PATH, multiple=True, help=setting.help)
    return include(setting_option("distro")(command))


def salvage_option(command: Command) -> Command:
    """Add the option that reads damaged bags as well."""
    help_text = (
        "Read what is whole of a damaged or cut off file. What is not is told, and the exit code is 1."
    )
    return click.option("--salvage", is_flag=True, help=help_text)(command)


_TIME = re.compile(r"(\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d)(?:\.(\d{1,9}))?(Z|[+-]\d\d:\d\d)?")


def _nanoseconds(context: click.Context, parameter: click.Parameter, text: str | None) -> int | None:
    """Return a point in time in nanoseconds since 1970, which is given so, or in ISO 8601 with a time zone."""
    if text is None:
        return None
    if text.isascii() and text.isdigit():
        return int(text)
    found = _TIME.fullmatch(text)
    try:
        if found is None:
            raise ValueError
        seconds, fraction, zone = found.groups(default="")
        date = datetime.fromisoformat(seconds + zone.replace("Z", "+00:00"))
    except ValueError:
        forms = "like 2026-05-01T12:00:00Z nor a number of nanoseconds since 1970"
        raise click.BadParameter(f"{text!r} is neither {forms}") from None
    if not zone:
        raise click.BadParameter(f"{text!r} has no time zone; write {text}Z for UTC")
    return to_nanoseconds(date) + int(fraction.ljust(9, "0"))


def time_options(command: Command) -> Command:
    """Add the options that choose a part of a bag; they reach the command as nanoseconds since 1970, or None."""
    help_text = "Only what was recorded {}: like 2026-05-01T12:00:00Z, or nanoseconds since 1970."
    start, end = (
        click.option(f"--{name}", metavar="TIME", callback=_nanoseconds, help=help_text.format(when))
        for name, when in (("start", "at this time or later"), ("end", "before this time"))
    )
    return start(end(command))


def _names(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> list[str] | None:
    return [name.strip() for text in texts for name in text.split(",")] or None


def fields_option(command: Command) -> Command:
    """Add the option that chooses fields of messages; they reach the command as a list of names, or None."""
    help_text = "Only these fields of the messages. May be repeated."
    return click.option("--fields", metavar="A.B,C", multiple=True, callback=_names, help=help_text)(command)


def plugin_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the option that names converter plugins; they reach the command with all others as `registry`."""

    @click.option(
        "--plugin",
        "plugins",
        multiple=True,
        metavar="MODULE:CLASS",
        help="A converter plugin that no installed package brings; Python has to find its module. May be repeated.",
    )
    @wraps(command)
    def with_registry(plugins: tuple[str, ...], **values: Any) -> Any:
        from rosidl_adapter_proto.converters import ConverterRegistry

        registry = ConverterRegistry()
        for each in plugins:
            registry.load(each)
        return command(registry=registry, **values)

    return with_registry


def generate_options(settings: Iterable[Setting]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return the decorator that gives a command options of how to generate, which reach it as `options`."""
    rows = tuple(settings)

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(command)
        def with_options(**values: Any) -> Any:
            options = Options.of({each.name: values.pop(each.attribute) for each in rows})
            _check_lock_file(options)
            return command(options=options, **values)

        for each in reversed(rows):
            with_options = setting_option(each.name)(with_options)
        return with_options

    return decorate


def _check_lock_file(options: Options) -> None:
    """Refuse a lock file on the command line that would be passed over; a configuration has been checked by itself."""
    source = click.get_current_context().get_parameter_source("lock_file")
    if source is ParameterSource.COMMANDLINE:
        try:
            check_lock_file_is_used(options.numbering)
        except ValueError as error:
            raise RequestError(f"--lock-file {error}") from None
