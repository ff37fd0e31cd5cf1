"""Gives the options of every command their defaults from the configuration."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from rosidl_adapter_proto.generate.configuration import find_configuration

_ARGUMENTS = {"packages": "what"}
"""Settings that are arguments of commands; all others are options."""


class ConfiguredGroup(click.Group):
    """A group of commands whose options take their defaults from the configuration."""

    def invoke(self, context: click.Context) -> Any:
        """Give every command the defaults of the configuration, and run the one that was asked for."""
        found = find_configuration(Path.cwd())
        if found is not None:
            values = {
                _ARGUMENTS.get(name, name.replace("-", "_")): each for name, each in found.values.items()
            }
            context.default_map = dict.fromkeys(self.commands, values)
        return super().invoke(context)
