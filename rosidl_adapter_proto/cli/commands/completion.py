"""`rosidl-proto completion`."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class


@click.command("completion")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def command(context: click.Context, shell: str) -> None:
    """Print the script that gives a shell completion: eval "$(rosidl-proto completion bash)"."""
    completion_class = get_completion_class(shell)
    assert completion_class is not None  # one of the choices
    program = context.find_root().command
    completion = completion_class(program, {}, "rosidl-proto", "_ROSIDL_PROTO_COMPLETE")
    click.echo(completion.source())
