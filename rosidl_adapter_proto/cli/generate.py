"""`rosidl-proto generate`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from rosidl_adapter_proto.cli.options import complete_package, find_request, source_options
from rosidl_adapter_proto.generate import Options, Result, generate
from rosidl_adapter_proto.generate.layout import Changes
from rosidl_adapter_proto.schema.numbering import LOCK_FILE_NAME, HashNumbering, SequentialNumbering


@click.command("generate")
@click.argument("what", nargs=-1, required=True, metavar="WHAT...", shell_complete=complete_package)
@click.option(
    "--output",
    "-o",
    type=click.Path(path_type=Path),
    default=Path("generated"),
    show_default=True,
    help="The folder to write. It holds what the last run made, and nothing older.",
)
@click.option("--deps/--no-deps", default=True, help="Generate the packages that WHAT depends on, too.")
@click.option(
    "--numbering",
    type=click.Choice([HashNumbering.name, SequentialNumbering.name]),
    default=HashNumbering.name,
    show_default=True,
    help="How fields are numbered: from a hash of their names, or in sequence with a lock file.",
)
@click.option(
    "--lock-file",
    type=click.Path(path_type=Path),
    default=Path(LOCK_FILE_NAME),
    show_default=True,
    help="Where sequential numbers are kept; commit it.",
)
@click.option("--events", is_flag=True, help="Include the _Event messages of service introspection.")
@click.option(
    "--python-root",
    default="rosidl_proto",
    show_default=True,
    metavar="NAME",
    help="The namespace package of the generated Python packages.",
)
@click.option("--check", is_flag=True, help="Write nothing; exit with 1 and a list if anything is stale.")
@click.option("--verbose", "-v", is_flag=True, help="List every file and where definitions come from.")
@source_options
def generate_command(
    what: tuple[str, ...],
    output: Path,
    deps: bool,
    numbering: str,
    lock_file: Path,
    events: bool,
    python_root: str,
    check: bool,
    verbose: bool,
    include: tuple[Path, ...],
    distro: str | None,
) -> int:
    """Generate .proto files, protobuf classes and adapters.

    WHAT is a package (std_msgs), a type (std_msgs/msg/String), a package folder or a folder of packages (./src), or
    a definition (./my_msgs/msg/Track.msg).
    """
    request, sources = find_request(what, include, distro, deps)
    options = Options(numbering, lock_file, events, python_root)
    with click.progressbar(
        length=1, label="generating", hidden=not sys.stderr.isatty(), file=sys.stderr
    ) as bar:

        def progress(done: int, total: int) -> None:
            bar.length = total
            bar.update(done - bar.pos)

        result = generate(request, sources, output, options, check=check, progress=progress)
    for warning in result.warnings:
        click.echo(f"warning: {warning}", err=True)
    if verbose:
        for name in result.interfaces:
            click.echo(f"{name} from {sources.definition(name).file}")
    if check:
        return _report_check(result, output, lock_file)
    _report(result, output, verbose)
    return 0


def _report(result: Result, output: Path, verbose: bool) -> None:
    if verbose:
        _list_files(result.changes, output)
    changes = result.changes
    counts = f"{len(changes.written)} written, {len(changes.removed)} removed, {changes.unchanged} unchanged"
    click.echo(f"{output}: {len(result.interfaces)} interfaces, {counts}")


def _report_check(result: Result, output: Path, lock_file: Path) -> int:
    if not result.is_stale:
        click.echo(f"{output} is up to date")
        return 0
    _list_files(result.changes, output)
    if result.lock_changed:
        click.echo(f"would write {lock_file}")
    return 1


def _list_files(changes: Changes, output: Path) -> None:
    for verb, paths in (("write", changes.written), ("remove", changes.removed)):
        for path in paths:
            click.echo(f"{verb} {output / path}")
