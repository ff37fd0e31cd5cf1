"""`rosidl-proto hook install`."""

from __future__ import annotations

from pathlib import Path

import click


@click.group("hook")
def command() -> None:
    """Have the builds of interface packages generate, too."""


@command.command("install")
@click.option(
    "--prefix",
    type=click.Path(path_type=Path),
    required=True,
    help="A prefix in AMENT_PREFIX_PATH, such as /opt/ros/kilted.",
)
def install_command(prefix: Path) -> None:
    """Install the ament_cmake hook to a prefix.

    Where this program and ROS are in one Python environment, the hook is there already.
    """
    from rosidl_adapter_proto.hooks.cmake import install_hook

    for file in install_hook(prefix):
        click.echo(f"wrote {file}")
