"""`rosidl-proto cmake-dir`."""

from __future__ import annotations

import click


@click.command("cmake-dir")
def command() -> None:
    """Print the folder of the hook's CMake files, for -Drosidl_generator_proto_DIR=DIR."""
    from rosidl_adapter_proto.hooks.cmake import cmake_folder

    click.echo(cmake_folder())
