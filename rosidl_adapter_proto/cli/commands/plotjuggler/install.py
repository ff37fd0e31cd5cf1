"""`rosidl-proto plotjuggler install`."""

from __future__ import annotations

from pathlib import Path

import click


@click.command("install", short_help="Copy our parser plugins to where PlotJuggler looks for them.")
@click.option(
    "--to", "folder", type=click.Path(path_type=Path), metavar="DIR", help="Copy them to this folder."
)
@click.option(
    "--version",
    type=click.Choice(["3", "4"]),
    default="3",
    show_default=True,
    help="For which PlotJuggler. No release of version 4 loads such plugins yet.",
)
@click.option("--force", is_flag=True, help="Replace files of their names that are none of our plugins.")
def command(folder: Path | None, version: str, force: bool) -> None:
    """Copy rosidl_proto_protobuf.wasm and rosidl_proto_ros2msg.wasm to where PlotJuggler looks for plugins of a user.

    That is PlotJuggler in $XDG_DATA_HOME, or in ~/.local/share. Start PlotJuggler anew afterwards.
    """
    from rosidl_adapter_proto.plotjuggler.install import install_plugins, plugin_folder

    for each in install_plugins(folder or plugin_folder(version), force=force):
        click.echo(f"{each.path}{'' if each.is_new else ' was there already'}")
