"""`rosidl-proto generate`."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from rosidl_adapter_proto.cli.options import (
    complete_name,
    generate_options,
    setting_option,
    source_options,
)
from rosidl_adapter_proto.cli.texts import show_warnings
from rosidl_adapter_proto.errors import RequestError
from rosidl_adapter_proto.generate import Options, Progress, Result, generate
from rosidl_adapter_proto.generate.request import find_request
from rosidl_adapter_proto.generate.settings import OPTIONS
from rosidl_adapter_proto.interfaces.find import Source
from rosidl_adapter_proto.interfaces.recorded import recorded_source

if TYPE_CHECKING:
    from rosidl_adapter_proto.bags.model import Topic
    from rosidl_adapter_proto.bags.types import RecordedTypes


@click.command("generate")
@click.argument("what", nargs=-1, metavar="WHAT...", shell_complete=complete_name)
@setting_option("output")
@setting_option("deps")
@generate_options(OPTIONS)
@click.option(
    "--from-bag",
    multiple=True,
    metavar="BAG",
    type=click.Path(),
    help="A recording whose definitions come before all others. Without WHAT, the types of its topics are generated. "
    "May be repeated.",
)
@click.option("--check", is_flag=True, help="Write nothing; exit with 1 and a list if anything is stale.")
@click.option(
    "--renumber",
    is_flag=True,
    help="Let fields get other numbers than OUTPUT was generated with: what was serialized with it cannot be read "
    "any more.",
)
@click.option("--verbose", "-v", is_flag=True, help="List every file and where definitions come from.")
@source_options
@click.pass_context
def command(
    context: click.Context,
    what: tuple[str, ...],
    output: Path,
    deps: bool,
    options: Options,
    from_bag: tuple[str, ...],
    check: bool,
    renumber: bool,
    verbose: bool,
    include: tuple[Path, ...],
    distro: str | None,
) -> int:
    """Generate .proto files, protobuf classes and adapters.

    WHAT is a package (std_msgs), a type (std_msgs/msg/String), a package folder or a folder of packages (./src), or
    a definition (./my_msgs/msg/Track.msg). It can be left out with --from-bag.
    """
    first: list[Source] = []
    if from_bag:
        recorded = _recorded(from_bag, include, distro)
        first.append(recorded_source(recorded.definitions))
        if context.get_parameter_source("what") is not ParameterSource.COMMANDLINE:
            what = tuple(map(str, (*recorded.types, *(recorded.definitions if deps else ()))))
    what = what or tuple((context.default_map or {}).get("what", ()))  # before 8.3, click does not look there
    if not what:
        raise click.UsageError(
            "Missing argument 'WHAT...': name a package, or set `packages` in the configuration."
        )
    request, catalog = find_request(what, include, distro, deps, first)
    with _progress() as progress:
        result = generate(
            request, catalog, output, options, check=check, renumber=renumber, progress=progress
        )
    show_warnings(result.warnings)
    if verbose:
        for name in result.interfaces:
            click.echo(f"{name} from {catalog.definition(name).file}")
    if check:
        return _report_check(result, output, options.lock_file)
    if verbose:
        _list_files(result, output, options.lock_file, "wrote", "removed")
    changes = result.changes
    counts = f"{len(changes.written)} written, {len(changes.removed)} removed, {changes.unchanged} unchanged"
    number = len(result.interfaces)
    click.echo(f"{output}: {number} interface{'s' if number != 1 else ''}, files: {counts}")
    return 0


def _recorded(bags: Sequence[str], include: Iterable[Path], distro: str | None) -> RecordedTypes:
    """Return what there is to generate of some bags, of the topics that have messages or definitions."""
    # They are slow to import, and a run without a bag does not need them.
    from rosidl_adapter_proto.bags.recording import find_recording
    from rosidl_adapter_proto.bags.types import BagTypes

    topics: list[Topic] = []
    for reader in chain.from_iterable(find_recording(each).readers() for each in bags):
        counts = reader.statistics.message_counts
        topics += (each for id, each in reader.topics.items() if counts.get(id) or each.definition.encoding)
    types = BagTypes(topics, include, distro)
    recorded = types.recorded_types()
    show_warnings(types.warnings)
    if not recorded.types:
        raise RequestError(f"{', '.join(bags)}: no topic has messages of a ROS type")
    return recorded


@contextlib.contextmanager
def _progress() -> Iterator[Progress | None]:
    """Show progress on a terminal, once there is some."""
    if not sys.stderr.isatty():
        yield None
        return
    with contextlib.ExitStack() as stack:
        bar: Any = None

        def show(done: int, total: int) -> None:
            nonlocal bar
            if bar is None:
                bar = stack.enter_context(
                    click.progressbar(length=total, label="generating", file=sys.stderr)
                )
            bar.update(done - bar.pos)

        yield show


def _report_check(result: Result, output: Path, lock_file: Path) -> int:
    if not result.is_stale:
        click.echo(f"{output} is up to date")
        return 0
    _list_files(result, output, lock_file, "would write", "would remove")
    return 1


def _list_files(result: Result, output: Path, lock_file: Path, wrote: str, removed: str) -> None:
    for path in result.changes.written:
        click.echo(f"{wrote} {output / path}")
    for path in result.changes.removed:
        click.echo(f"{removed} {output / path}")
    if result.lock_changed:
        click.echo(f"{wrote} {lock_file}")
