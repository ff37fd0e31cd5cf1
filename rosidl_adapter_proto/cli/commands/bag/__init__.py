"""`rosidl-proto bag`: one module for each of its commands."""

from __future__ import annotations

import importlib
import pkgutil

import click


@click.group("bag")
def command() -> None:
    """Read, convert and describe bags."""


for module in pkgutil.iter_modules(__path__):
    command.add_command(importlib.import_module(f"{__name__}.{module.name}").command)
