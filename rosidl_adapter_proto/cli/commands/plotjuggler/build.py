"""`rosidl-proto plotjuggler build`."""

from __future__ import annotations

from pathlib import Path

import click

from rosidl_adapter_proto.cli.texts import size_text


@click.command("build", short_help="Build the parser plugins.")
@click.option(
    "--output",
    metavar="DIR",
    type=click.Path(path_type=Path),
    default=Path(),
    help="Where the plugins go; by default the current folder.",
)
def command(output: Path) -> None:
    """Build protobuf.wasm and ros2msg.wasm, parser plugins of PlotJuggler.

    Each of them serves PlotJuggler 3 and, as far as it is released, PlotJuggler 4. They are the same, byte for byte,
    wherever they are built. The first time takes longer, since the compiler builds its C++ library.
    """
    from rosidl_adapter_proto.plotjuggler.build import build_plugins

    for plugin in build_plugins(output):
        click.echo(f"{plugin} ({size_text(plugin.stat().st_size)})")
