# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Hook of mkdocs that adds the pages generated from code to the files of docs/."""

from __future__ import annotations

from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from docsite.architecture import architecture_page
from docsite.commands import commands_page
from docsite.effects import effects_page
from docsite.examples import examples_page
from docsite.nodes import nodes_page
from docsite.notebooks import executed
from docsite.numbers import numbers_page
from docsite.schemas import schemas_page
from docsite.speed import speed_page

ROOT = Path(__file__).parents[1]
NOTEBOOKS = ROOT / 'examples' / 'notebooks'


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages to the files of the documentation site."""
    reference = Path(config.docs_dir) / 'reference'
    pages = {
        'explanation/architecture.md': architecture_page(ROOT / 'armid_ros'),
        'reference/commands.md': commands_page(),
        'reference/effects.md': effects_page(),
        'reference/examples.md': examples_page(ROOT / 'examples'),
        'reference/numbers.md': numbers_page(ROOT / 'armid_ros' / 'diagnosis'),
        'reference/nodes.md': nodes_page(_removed(files, reference / 'nodes.md')),
        'reference/files.md': schemas_page(_removed(files, reference / 'files.md')),
        'reference/speed.md': speed_page(ROOT / 'benchmarks' / 'results' / 'speed.json'),
    }
    for uri, text in pages.items():
        files.append(File.generated(config, uri, content=text))
    for path in sorted(NOTEBOOKS.glob('*.py')):
        page, beside = executed(path)
        uri = f'notebooks/{path.stem}.md'
        files.append(File.generated(config, uri, content=page))
        for name, content in beside.items():
            files.append(File.generated(config, f'notebooks/{name}', content=content))
    return files


def _removed(files: Files, path: Path) -> str:
    """Return the hand-written text of a page, and remove the page from the site's files."""
    for file in list(files):
        if file.abs_src_path and Path(file.abs_src_path) == path:
            files.remove(file)
    return path.read_text(encoding='utf-8')
