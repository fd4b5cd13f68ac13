# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Sections of a report inside another page, such as a notebook.

The style of the reports is put below one class, so that it changes nothing around it; sections
that need the script of a report have no place here.

"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
import re

from armid_ros.report.page import asset, render, Section

CLASS = 'armid-result'
#: Sections that are unfolded at first.
_OPEN = 2


def fragment(sections: Sequence[Section]) -> str:
    """
    Return sections as HTML to be put into another page.

    Parameters
    ----------
    sections : sequence of Section
        In order; those without a title are shown as they are.

    """
    values = {'class': CLASS, 'style': _style(), 'sections': sections, 'n_open': _OPEN}
    return str(render('fragment.html', values))


@cache
def _style() -> str:
    """Return the style of the reports, below one class."""
    css = str(asset('report.css'))
    css = css[: css.index('@media print')]
    css = re.sub(r'/\*.*?\*/', '', css, flags=re.DOTALL)
    css = re.sub(r'(?m)^html \{.*\}\n', '', css)
    css = re.sub(r':root(:not\(\.paper\))?(?= \{)', '&', css)
    css = re.sub(r'(?m)^( *)body(?= \{)', r'\1&', css)
    return f'.{CLASS} {{{css}& {{ margin: 0; padding: 8px 12px; }}}}'
