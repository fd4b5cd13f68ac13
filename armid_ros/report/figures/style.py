# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What all figures share: size, type, colours that the colour-blind can tell apart."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

from armid_ros.files import write_file
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

#: Width of a figure [in]; shown 830 px wide in a README its smallest type is 10 px high.
WIDTH = 8.6
_DPI = 160

MEASURED = '#333333'
PREDICTED = '#d55e00'
RESIDUAL = '#0072b2'
#: Okabe and Ito (2008), without the yellow that white paper swallows.
COLOURS = ('#0072b2', '#d55e00', '#009e73', '#cc79a7', '#56b4e9', '#e69f00')

_TITLE, _TEXT = 9.0, 8.0


def new_figure(height: float) -> Figure:
    """Return an empty figure of the common width and a height [in]."""
    figure = Figure(figsize=(WIDTH, height), dpi=_DPI, layout='constrained', facecolor='white')
    FigureCanvasAgg(figure)
    figure.get_layout_engine().set(w_pad=0.06, h_pad=0.04)  # type: ignore[union-attr, call-arg]
    return figure


def save_figure(figure: Figure, path: str | Path) -> None:
    """Write a figure; the suffix of the path, .png, .svg or .pdf, chooses the format."""
    kind = Path(path).suffix.removeprefix('.')
    content = BytesIO()
    metadata = {'Date': None} if kind == 'svg' else None
    figure.savefig(content, dpi=_DPI, format=kind, metadata=metadata)
    write_file(path, content.getvalue())


def plain(axes: Axes, title: str = '', *, xlabel: str = '', ylabel: str = '') -> None:
    """Give axes the common look: no box, a faint grid behind the data, small type."""
    axes.set_title(title, fontsize=_TITLE, loc='left', fontweight='bold')
    axes.set_xlabel(xlabel, fontsize=_TEXT)
    axes.set_ylabel(ylabel, fontsize=_TEXT)
    axes.tick_params(labelsize=_TEXT, length=2.5, color='#888888')
    axes.spines[['top', 'right']].set_visible(False)
    axes.spines[['left', 'bottom']].set_color('#888888')
    axes.grid(True, color='#e8e8e8', linewidth=0.6)
    axes.set_axisbelow(True)


def legend(figure: Figure, axes: Axes, columns: int = 6) -> None:
    """Put the legend of some axes above the whole figure, clear of all data."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        loc='outside upper center',
        ncols=min(columns, len(labels)),
        frameon=False,
        fontsize=_TITLE,
    )
