"""`rosidl-proto plotjuggler check`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from rosidl_adapter_proto.cli.series_options import require_plotjuggler

if TYPE_CHECKING:
    from rosidl_adapter_proto.plotjuggler.check import Report

EXIT_UNMET = 1


@click.command("check", short_help="Tell which contracts a parser plugin meets.")
@click.argument("plugin", type=click.Path(path_type=Path))
@click.pass_context
def command(context: click.Context, plugin: Path) -> None:
    """Tell which contracts PLUGIN, a .wasm file, meets: the one of the released PlotJuggler 3, the one of its page on
    WASM plugins, and the one of parser modules of PlotJuggler 4.

    No messages are needed. The exit code is 0 if it meets at least one of them whole, else 1.
    """
    require_plotjuggler()
    from rosidl_adapter_proto.plotjuggler.check import check_plugin

    reports = check_plugin(plugin)
    for report in reports:
        _print(report)
    met = [report.dialect.name for report in reports if report.met]
    click.echo(f"{plugin.name} meets {', '.join(met) if met else 'none of them'}")
    context.exit(0 if met else EXIT_UNMET)


def _print(report: Report) -> None:
    if not report.served:
        click.echo(
            f"{report.dialect.name} ({report.dialect.title}): not served; {report.dialect.parse} is missing\n"
        )
        return
    click.echo(f"{report.dialect.name} ({report.dialect.title}): {'met' if report.met else 'not met'}")
    for point in report.points:
        remark = f": {point.remark}" if point.remark else ""
        click.echo(f"  {'yes' if point.met else 'NO '}  {point.name}{remark}")
    click.echo()
