"""The command line, `rosidl-proto`: parses, calls, prints.

Exit codes: 0 done; 1 `--check` found something stale, something of a bag was left out, `plotjuggler check` found no
contract that is met, or what reads the output went away; 2 the command line or its configuration is wrong; 3 the work
could not be done (a definition, a lock file, the output folder or protoc is at fault); 130 interrupted.
"""

from __future__ import annotations

import errno
import importlib
import io
import pkgutil
import sys
import traceback

import click

from rosidl_adapter_proto import __version__
from rosidl_adapter_proto.cli import commands
from rosidl_adapter_proto.cli.configuration import ConfiguredGroup
from rosidl_adapter_proto.errors import Error, RequestError

EXIT_USAGE = 2
EXIT_FAILED = 3
EXIT_INTERRUPTED = 130


@click.group(cls=ConfiguredGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__)
@click.option("--debug", is_flag=True, help="Show where in the program an error comes from.")
def program(debug: bool) -> None:
    """Protobuf types and adapters from ROS 2 interface definitions.

    Settings are also read from [tool.rosidl-proto] of pyproject.toml in the current folder or above it; the command
    line comes first.
    """


for module in pkgutil.iter_modules(commands.__path__):
    program.add_command(importlib.import_module(f"{commands.__name__}.{module.name}").command)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line, and exit."""
    given = sys.argv[1:] if arguments is None else arguments
    debug = "--debug" in given
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # definitions may have what the terminal's encoding has not
    try:
        # It is taken out, so that it may also stand behind the command.
        status = program.main(
            [each for each in given if each != "--debug"], prog_name="rosidl-proto", standalone_mode=False
        )
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except (click.Abort, KeyboardInterrupt):
        click.echo("interrupted; no half-written output is left", err=True)
        sys.exit(EXIT_INTERRUPTED)
    except Exception as error:
        if debug:
            traceback.print_exc()
        if isinstance(error, Error):
            click.echo(f"Error: {error}", err=True)
        elif isinstance(error, OSError) and error.errno == errno.ENOSPC and error.filename is None:
            # Whatever writes files says which one; what is printed has no name.
            click.echo(
                f"Error: cannot write to the standard output: {error.strerror}; make room there", err=True
            )
        else:
            click.echo(f"Internal error: {error!r}; --debug shows where it comes from", err=True)
        sys.exit(EXIT_USAGE if isinstance(error, RequestError) else EXIT_FAILED)
    sys.exit(status or 0)
