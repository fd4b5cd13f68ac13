# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The page of a report: one file without external resources, with a sequence of sections.

A section is a small frozen dataclass with a title and a template.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
import re
from typing import Any, ClassVar

from armid_ros.report.notation import (
    common_prefix,
    counted,
    digits,
    explained,
    plain,
    pretty,
    without_prefix,
)
from armid_ros.version import GENERATOR
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

#: Labels, in which names of joints and links are without their common prefix.
_LABELS = re.compile(
    r'<(table|figure|svg|summary|h3|div(?= class="bar-label"))\b.*?</\1>', flags=re.DOTALL
)


class Templated:
    """
    A block of a page with a template; the template refers to the block as `block`.

    Attributes
    ----------
    template : str
        Name of the file in templates/.
    package : str
        Package with the folder templates/; a plug-in has its own templates.

    """

    template: ClassVar[str]
    package: ClassVar[str] = 'armid_ros.report'

    def html(self) -> Markup:
        """Return the page as HTML, with all text escaped."""
        return render(self.template, {'block': self, 'section': self}, self.package)


class Section(Templated):
    """
    A section of a page; its template refers to it as `section`.

    Attributes
    ----------
    title : str
        Heading; empty for none.

    """

    title: ClassVar[str]

    @property
    def anchor(self) -> str:
        """Name of the section within the page, for links."""
        return re.sub('[^a-z0-9]+', '-', self.title.lower()).strip('-')


@dataclass(frozen=True)
class Page:
    """
    Page of a report.

    Attributes
    ----------
    title : str
        Heading.
    subtitle : str
        Robot, data, day; in a line.
    sections : sequence of Section
        Parts in order; the first is the verdict.
    charts : bool
        Whether the page has interactive charts.
    names : sequence of str
        Joints and links of the arm. Tables and charts leave their common prefix out.

    """

    title: str
    subtitle: str
    sections: Sequence[Section]
    charts: bool = True
    names: Sequence[str] = ()

    def html(self) -> str:
        """Return the whole file, scripts and styles included."""
        assets = {
            'generator': Markup(GENERATOR),
            'chart_library': asset('uPlot.iife.min.js'),
            'chart_licence': asset('uPlot.LICENSE'),
            'chart_style': asset('uPlot.min.css'),
            'script': asset('report.js'),
            'style': asset('report.css'),
        }
        text = render('page.html', {'page': self, 'prefix': common_prefix(self.names), **assets})
        shown = _LABELS.sub(lambda label: without_prefix(label[0], self.names), text)
        # passwords in arguments and in URLs
        shown = re.sub(r'(\w*(?:passw|token|secret)\w*:?=)[^\s<"&]+', r'\1***', shown)
        shown = re.sub(r'://[^/\s@<>"]+:[^/\s@<>"]+@', '://***@', shown)
        # escape control characters in file names
        return re.sub(r'[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]', lambda c: repr(c[0])[1:-1], shown)


def render(template: str, values: Mapping[str, Any], package: str = 'armid_ros.report') -> Markup:
    """Return a template of the templates/ of a package with values filled in and escaped."""
    return Markup(_environment(package).get_template(template).render(values))


@cache
def _environment(package: str) -> Environment:
    environment = Environment(
        loader=PackageLoader(package),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(digits=digits, pretty=pretty, explained=explained)
    environment.globals.update(counted=counted, plain=plain)
    return environment


def asset(name: str) -> Markup:
    """Return a file of assets/, which is part of this package and trusted."""
    return Markup((files('armid_ros.report') / 'assets' / name).read_text(encoding='utf-8'))
