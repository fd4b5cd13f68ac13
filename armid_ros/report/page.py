# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The page of a report: one file without external resources, with a sequence of sections.

A section is a small frozen dataclass with a title and a template.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextvars import ContextVar
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
    many_counted,
    plain,
    pretty,
    without_prefix,
)
from armid_ros.version import GENERATOR
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

#: Names of joints and links whose common prefix the present page omits.
_names: ContextVar[Sequence[str]] = ContextVar('_names', default=())


class Templated:
    """
    A block of a page with a template; the template refers to the block as `block`.

    Attributes
    ----------
    template : str
        Name of the file in templates/.
    package : str
        Package with the folder templates/; a plug-in has its own templates.
    short_names : bool
        Whether names of joints and links in it are without their common prefix.

    """

    template: ClassVar[str]
    package: ClassVar[str] = 'armid_ros.report'
    short_names: ClassVar[bool] = False

    def html(self) -> Markup:
        """Return the page as HTML, with all text escaped."""
        text = render(self.template, {'block': self, 'section': self}, self.package)
        return _short(text) if self.short_names else text


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
    A report.

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
        Joints and links of the arm. Labels leave their common prefix out.

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
        token = _names.set(self.names)
        text = render('page.html', {'page': self, 'prefix': common_prefix(self.names), **assets})
        _names.reset(token)
        # passwords in arguments and in URLs
        shown = re.sub(r'(\w*(?:passw|token|secret)\w*:?=)[^\s<"&]+', r'\1***', str(text))
        shown = re.sub(r'://[^/\s@<>"]+:[^/\s@<>"]+@', '://***@', shown)
        # escape control characters in file names
        return re.sub(r'[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]', lambda c: repr(c[0])[1:-1], shown)


def _short(text: str) -> Markup:
    """Return a label, markup included, with short names of joints and links."""
    return Markup(without_prefix(text, _names.get()))


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
    environment.filters.update(
        digits=digits,
        pretty=pretty,
        short=_short,
        few=lambda text: Markup(many_counted(text, _names.get())),
        explained=explained,
    )
    environment.globals['counted'] = counted
    environment.globals['plain'] = plain
    return environment


def asset(name: str) -> Markup:
    """Return a file of assets/, which is part of this package and trusted."""
    return Markup((files('armid_ros.report') / 'assets' / name).read_text(encoding='utf-8'))
