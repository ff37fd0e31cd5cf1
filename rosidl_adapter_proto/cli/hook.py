"""`rosidl-proto hook install` and `rosidl-proto cmake-dir`."""

from __future__ import annotations

from pathlib import Path

import click


@click.command("cmake-dir")
def cmake_dir_command() -> None:
    """Print the folder of the hook's CMake files, for -Drosidl_generator_proto_DIR=DIR."""
    from rosidl_adapter_proto.generate.cmake import cmake_folder

    click.echo(cmake_folder())


@click.group("hook")
def hook_group() -> None:
    """Have the builds of interface packages generate, too."""


@hook_group.command("install")
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
    from rosidl_adapter_proto.generate.cmake import install_hook

    for file in install_hook(prefix):
        click.echo(f"wrote {file}")
