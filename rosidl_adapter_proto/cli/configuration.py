"""Gives the options of every command their defaults from the configuration."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from rosidl_adapter_proto.errors import RequestError
from rosidl_adapter_proto.generate.configuration import find_configuration

_ARGUMENTS = {"packages": "what"}
"""Settings that are arguments of commands; all others are options."""


class ConfiguredGroup(click.Group):
    """A group of commands whose options take their defaults from the configuration."""

    def invoke(self, context: click.Context) -> Any:
        """Give every command the defaults of the configuration, and run the one that was asked for."""
        try:
            folder = Path.cwd()
        except OSError as error:
            raise RequestError(
                f"cannot tell the current folder: {error.strerror}; change to one that exists"
            ) from None
        found = find_configuration(folder)
        if found is not None:
            values = {
                _ARGUMENTS.get(name, name.replace("-", "_")): each for name, each in found.values.items()
            }
            context.default_map = _defaults(self, values)
        return super().invoke(context)


def _defaults(command: click.Command, values: dict[str, Any]) -> dict[str, Any]:
    """Return what click looks up for a command: its values, or those of each command in a group."""
    if not isinstance(command, click.Group):
        return values
    return {name: _defaults(each, values) for name, each in command.commands.items()}
