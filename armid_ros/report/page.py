# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
HTML page of a report: a single file without external resources.

A block of a section is a small frozen dataclass with a template.

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
)
from armid_ros.report.provenance import Provenance
from armid_ros.version import GENERATOR
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

#: Labels, in which names of joints and links are without their common prefix.
_LABELS = re.compile(
    r'<(table|figure|svg|summary|h3|div(?= class="bar-label"))\b.*?</\1>', flags=re.DOTALL
)


class Templated:
    """
    Base class of page blocks; a Jinja template with the variable `block` renders each block.

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
        """Return the block as HTML; all text is escaped."""
        return render(self.template, {'block': self}, self.package)


@dataclass(frozen=True)
class Section(Templated):
    """
    Section of a page: a heading and a sequence of blocks.

    Attributes
    ----------
    title : str
        Heading.
    blocks : sequence of Templated
        Content, in order.

    """

    template: ClassVar[str] = 'section.html'

    title: str
    blocks: Sequence[Templated]

    @property
    def anchor(self) -> str:
        """Identifier of the section for links inside the page."""
        return re.sub('[^a-z0-9]+', '-', self.title.lower()).strip('-')


@dataclass(frozen=True)
class Page:
    """
    Page of a report: heading, verdict, sections and provenance.

    Attributes
    ----------
    title : str
        Heading.
    subtitle : str
        Line below the heading: robot and recordings.
    verdict : Templated
        Box at the top of the page.
    sections : sequence of Section
        Sections in order.
    provenance : Provenance or None
        How the result was made, for the last section; None for pages of a folder of results.
    names : sequence of str
        Joints and links of the arm. Tables and charts leave their common prefix out.

    """

    title: str
    subtitle: str
    verdict: Templated
    sections: Sequence[Section]
    provenance: Provenance | None = None
    names: Sequence[str] = ()

    def html(self) -> str:
        """Return the page as a single HTML file, including scripts and styles."""
        assets = {
            'generator': Markup(GENERATOR),
            'chart_library': asset('uPlot.iife.min.js'),
            'chart_licence': asset('uPlot.LICENSE'),
            'chart_style': asset('uPlot.min.css'),
            'script': asset('report.js'),
            'style': asset('report.css'),
        }
        prefix = common_prefix(self.names)
        shown = str(render('page.html', {'page': self, 'prefix': prefix, **assets}))
        if prefix:  # labels leave it out of names, but not of paths
            rests = '|'.join(re.escape(name.removeprefix(prefix)) for name in self.names)
            name = re.compile(rf'(?<![\w/.-]){re.escape(prefix)}(?=(?:{rests})(?![\w/]|\.\w))')
            shown = _LABELS.sub(lambda label: name.sub('', label[0]), shown)
        # passwords in arguments and in URLs
        shown = re.sub(r'(\w*(?:passw|token|secret)\w*:?=)[^\s<"&]+', r'\1***', shown)
        shown = re.sub(r'://[^/\s@<>"]+:[^/\s@<>"]+@', '://***@', shown)
        # escape control characters in file names
        return re.sub(r'[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]', lambda c: repr(c[0])[1:-1], shown)


def render(template: str, values: Mapping[str, Any], package: str = 'armid_ros.report') -> Markup:
    """Render a template of a package with given values; all text is escaped."""
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
    """Return the content of a file in assets/, for insertion without escaping."""
    return Markup((files('armid_ros.report') / 'assets' / name).read_text(encoding='utf-8'))
