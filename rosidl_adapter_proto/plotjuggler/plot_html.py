"""Plots as one HTML page, which plotly's JavaScript inside it draws, without a network.

Needs plotly: `pip install 'rosidl-adapter-proto[plot]'`.
"""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any

from rosidl_adapter_proto.plotjuggler.plot import Line, Plot

try:
    from plotly.graph_objects import Figure
except ImportError as error:
    raise ImportError(
        f"plots as HTML need plotly ({error}); pip install 'rosidl-adapter-proto[plot]'", name="plotly"
    ) from error

# The policy has the browser refuse whatever goes to or comes from elsewhere; images are those that one saves.
_PAGE = """\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
  content="default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:;
    form-action 'none'; base-uri 'none'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>html, body, body > div {{ height: 100%; margin: 0 }}</style>
</head>
<body>
{plot}
</body>
</html>
"""

_GRID = {"gridcolor": "#e5e5e5", "zerolinecolor": "#c8c8c8"}
_CONFIGURATION = {
    "displaylogo": False,
    "plotlyServerURL": "",
    "responsive": True,
    "scrollZoom": True,
    "showSendToCloud": False,  # plotly 7 shows a button that uploads the data
}


def write_html(plot: Plot, path: Path) -> None:
    """Write a plot as a page that needs nothing else."""
    figure = Figure(data=[_trace(line) for line in plot.lines], layout=_layout(plot))
    drawn = figure.to_html(_CONFIGURATION, include_plotlyjs=True, full_html=False, div_id="plot")
    path.write_text(_PAGE.format(title=escape(plot.title), plot=drawn), encoding="utf-8")


def _trace(line: Line) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines+markers" if line.is_marked else "lines",
        "name": _literal(line.name),
        "x": line.times,
        "y": line.values,
        "line": {"color": line.colour, "width": 1.5, "shape": "hv" if line.is_stepped else "linear"},
    }


def _layout(plot: Plot) -> dict[str, Any]:
    notes = "".join(f"<br><sup>{_literal(note)}</sup>" for note in plot.notes)
    return {
        "template": "none",
        "title": {"text": _literal(plot.title) + notes, "x": 0.5},
        "xaxis": {"title": {"text": plot.time_label}, "hoverformat": ".6f", "ticksuffix": " s", **_GRID},
        "yaxis": {"hoverformat": ".9~g", "exponentformat": "power", **_GRID},
        "hovermode": "x unified",
        "hoverlabel": {"namelength": -1},
        "dragmode": "zoom",
        "showlegend": True,
        "legend": {"orientation": "h", "x": 0.5, "xanchor": "center", "y": -0.12, "yanchor": "top"},
        "margin": {"l": 70, "r": 30, "t": 60 + 18 * len(plot.notes), "b": 60},
    }


def _literal(text: str) -> str:
    """Return a text that plotly takes for no tags and no formula."""
    return escape(text).replace("$", "&#36;")
