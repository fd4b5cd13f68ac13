# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Data of the interactive charts of a page, which assets/report.js draws.

A series has a role, not a colour: the style sheet has a colour for each role, one for light, one
for dark and one for paper.

"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass, replace
from io import BytesIO
import json
from typing import Any, ClassVar, Literal

from armid_ros.motion import FloatArray, read_only
from armid_ros.report.page import Templated
from markupsafe import Markup
import numpy as np
import numpy.typing as npt

Role = Literal['measured', 'predicted', 'residual', 'before', 'after', 'floor', 'trend', 'faint']
Kind = Literal['line', 'trend', 'points', 'sticks', 'band']


@dataclass(frozen=True)
class Series:
    """
    Curve, points or band of a chart.

    Attributes
    ----------
    label : str
        Name in the legend.
    y : ndarray, shape (N,)
        Ordinates; a curve breaks at NaN.
    role : str
        Role of the series, which gives the colour.
    kind : str
        Kind of drawing: 'line', broken at NaN; 'trend', with dots and not broken; 'points';
        'sticks' from zero; or a 'band' from y to ``upper``.
    upper : ndarray, shape (N,), or None
        Upper edge of a band.

    """

    label: str
    y: FloatArray
    role: Role = 'measured'
    kind: Kind = 'line'
    upper: FloatArray | None = None


@dataclass(frozen=True)
class Chart(Templated):
    """
    Chart of curves with a common horizontal axis and zoom.

    Attributes
    ----------
    x : ndarray, shape (N,)
        Common abscissa, not decreasing.
    series : sequence of Series
        Curves, the first one at the bottom.
    xlabel, ylabel : str
        Labels of the axes with units; xlabel is empty if the chart below has it.
    height : int
        [CSS pixel].
    link : str
        Charts with the same name zoom together; empty for none.
    levels : sequence of (float, str)
        Horizontal lines: ordinate, and text at the right end.
    marks : sequence of (float, str, bool)
        Vertical lines: abscissa, text at the foot, and whether it is on the left.
    logarithmic : bool
        Whether the abscissa is logarithmic; its values then have to be positive.
    symmetric : bool
        Whether zero is in the middle of the ordinate.
    legend : bool
        Whether there is a legend, with the values under the pointer.

    """

    template: ClassVar[str] = 'chart.html'

    x: FloatArray
    series: Sequence[Series]
    xlabel: str
    ylabel: str
    height: int = 220
    link: str = ''
    levels: Sequence[tuple[float, str]] = ()
    marks: Sequence[tuple[float, str, bool]] = ()
    logarithmic: bool = False
    symmetric: bool = False
    legend: bool = True

    @classmethod
    def over_time(
        cls, t: FloatArray, series: Sequence[Series], ylabel: str, **others: Any
    ) -> Chart:
        """Return a chart over time [s]; samples without visible influence are left out."""
        kept = thinned(*(one.y for one in series))
        drawn = [
            replace(one, y=one.y[kept], upper=None if one.upper is None else one.upper[kept])
            for one in series
        ]
        return cls(t[kept], drawn, 'time [s]', ylabel, **others)

    @property
    def json(self) -> Markup:
        """Chart data as JSON for the script assets/report.js."""
        data = {
            'x': rounded(self.x),
            'xlabel': self.xlabel,
            'ylabel': self.ylabel,
            'height': self.height,
            'link': self.link,
            'symmetric': self.symmetric,
            'legend': self.legend,
            'logarithmic': self.logarithmic,
            'levels': [{'y': y, 'label': label} for y, label in self.levels],
            'marks': [{'x': x, 'label': s, 'before': left} for x, s, left in self.marks],
            'series': [
                {
                    'label': series.label,
                    'role': series.role,
                    'kind': series.kind,
                    'y': rounded(series.y),
                    'upper': None if series.upper is None else rounded(series.upper),
                }
                for series in self.series
            ],
        }
        return script_json(data)


def thinned(*series: npt.ArrayLike, most: int = 3000) -> npt.NDArray[np.intp]:
    """
    Return the indices of samples that suffice to draw curves without a visible difference.

    Parameters
    ----------
    *series : array_like, shape (N,)
        Curves over the same samples.
    most : int
        About how many samples to keep.

    Returns
    -------
    ndarray of int
        Samples in order: all, or those where one of the curves is lowest or highest within each
        of many equal stretches. The ends of stretches with NaN are kept, because they mark breaks.

    """
    curves = [np.asarray(values, dtype=float) for values in series]
    count = len(curves[0])
    if count <= most:
        return np.arange(count)
    stretches = max(1, most // (2 * len(curves)))
    edges = np.linspace(0, count, stretches + 1).astype(np.intp)[:-1]
    kept = [np.array([0, count - 1])]
    for curve in curves:
        broken = np.isnan(curve)
        kept.append(np.flatnonzero(broken[1:-1] & ~(broken[:-2] & broken[2:])) + 1)
        for sign in (1.0, -1.0):
            value = np.where(np.isnan(curve), -np.inf, sign * curve)
            best = np.maximum.reduceat(value, edges)
            first = np.flatnonzero(value == np.repeat(best, np.diff([*edges, count])))
            stretch = np.searchsorted(edges, first, side='right')
            kept.append(first[np.unique(stretch, return_index=True)[1]])
    return np.unique(np.concatenate(kept))


def joined(parts: Sequence[FloatArray]) -> FloatArray:
    """Concatenate values of gap-free sections; NaN between two sections breaks the curve."""
    pieces = [part for stretch in parts for part in (stretch, [np.nan])]
    return read_only(np.concatenate(pieces[:-1]))


def joined_time(parts: Sequence[FloatArray]) -> FloatArray:
    """Concatenate times of gap-free sections, with one more time per gap, to match `joined`."""
    pieces = [part for stretch in parts for part in (stretch, stretch[-1:])]
    return read_only(np.concatenate(pieces[:-1]))


def rounded(values: npt.ArrayLike) -> list[float | None]:
    """Round values of a chart to a tenth of a pixel; NaN becomes None."""
    array = np.asarray(values, dtype=float)
    finite = array[np.isfinite(array)]
    span = float(np.ptp(finite)) if len(finite) else 0.0
    # resolution of written values as a share of their range, a tenth of a pixel
    step = 2e-5 * (span or (abs(float(finite[0])) if len(finite) else 1.0) or 1.0)
    decimals = int(np.ceil(-np.log10(step)))
    return [round(value, decimals) if np.isfinite(value) else None for value in array.tolist()]


def script_json(data: dict[str, Any]) -> Markup:
    """Format data as JSON that is safe inside a script element of HTML."""
    text = json.dumps(data, allow_nan=False, separators=(',', ':'))
    for character in '<>&\u2028\u2029':
        text = text.replace(character, f'\\u{ord(character):04x}')
    return Markup(text)


def image_data(colour: FloatArray, strength: FloatArray) -> str:
    """
    Convert an image to the data URL of a PNG file.

    Parameters
    ----------
    colour : ndarray, shape (H, W, 3)
        Red, green and blue, 0 to 1.
    strength : ndarray, shape (H, W)
        Opacity, clipped to 0 to 1.

    """
    from matplotlib.image import imsave  # slow import, and few pages have an image

    pixels = np.concatenate([colour, np.clip(np.abs(strength), 0.0, 1.0)[..., None]], axis=-1)
    png = BytesIO()
    imsave(png, np.rint(255.0 * pixels).astype(np.uint8), format='png')
    return f'data:image/png;base64,{b64encode(png.getvalue()).decode()}'
