"""`rosidl-proto plotjuggler`: one module for each of its commands."""

from __future__ import annotations

import importlib
import pkgutil

import click


@click.group("plotjuggler")
def command() -> None:
    """Parser plugins of PlotJuggler, and time series of bags."""


for module in pkgutil.iter_modules(__path__):
    command.add_command(importlib.import_module(f"{__name__}.{module.name}").command)
