# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Links of a built site: each target has to exist, and no page loads external files."""

from __future__ import annotations

from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

#: Attributes with the address of another file.
_LINKS = ('href', 'src')


class _Page(HTMLParser):
    """The links and anchors of an HTML page."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[tuple[str, str]] = []
        self.anchors: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Store the links and anchors of an HTML tag."""
        for name, value in attrs:
            if name in _LINKS and value:
                self.links.append((tag, value))
            if name in ('id', 'name') and value:
                self.anchors.add(value)


def _read(path: Path) -> _Page:
    page = _Page()
    page.feed(path.read_text(encoding='utf-8'))
    return page


def broken_links(site: Path) -> Iterator[str]:
    """
    Yield links without a target from all pages, and files that a page loads from a network.

    Links to other sites are not checked.

    """
    pages = {path.resolve(): _read(path) for path in site.rglob('*.html')}
    for path, page in pages.items():
        if path.name == '404.html':  # links of this page begin at the root of a server
            continue
        for tag, link in page.links:
            there = urlsplit(link)
            if there.scheme in ('data', 'mailto'):
                continue
            if there.scheme or there.netloc:
                if tag != 'a':
                    yield f'{path.name}: <{tag}> loads {link}'
                continue
            target = (path.parent / unquote(there.path)).resolve() if there.path else path
            if target.is_dir():
                target /= 'index.html'
            if not target.exists():
                yield f'{path.name}: {link}'
            elif there.fragment and target in pages:
                if unquote(there.fragment) not in pages[target].anchors:
                    yield f'{path.name}: the anchor of {link} does not exist'
