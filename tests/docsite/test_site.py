# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The site builds without a warning, is complete, and has no broken link."""

import json
import os
from pathlib import Path
import subprocess
import sys

import armid_ros as ar
from armid_ros.cli import main
from armid_ros.effects import CATALOGUE
import pytest

from docsite.links import broken_links
from docsite.nodes import NODES

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope='module')
def site(tmp_path_factory):
    """Build the site as `make docs` does, with executed notebooks; return its folder."""
    folder = tmp_path_factory.mktemp('site')
    done = subprocess.run(
        [sys.executable, '-m', 'mkdocs', 'build', '--strict', '--site-dir', folder],
        cwd=ROOT,
        env={**os.environ, 'NO_MKDOCS_2_WARNING': '1'},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_every_link_leads_somewhere_and_nothing_is_loaded_from_a_network(site):
    assert list(broken_links(site)) == []


def test_links_to_files_and_places_that_are_not_there_are_noticed(tmp_path):
    (tmp_path / 'a.html').write_text('<a href="b.html#here">b</a><a href="c.html">c</a>')
    (tmp_path / 'b.html').write_text('<h1 id="there">b</h1><script src="https://x.org/y.js">')
    first, second, third = sorted(broken_links(tmp_path))
    assert first.startswith('a.html: b.html#here')
    assert second == 'a.html: c.html'
    assert third.startswith('b.html: ') and 'https://x.org/y.js' in third


def test_the_reference_has_every_name_command_node_and_effect(site):
    for page, names in (
        ('python', ar.__all__),
        ('commands', main.list_commands(None)),
        ('nodes', NODES),
        ('effects', CATALOGUE),
    ):
        text = (site / 'reference' / f'{page}.html').read_text()
        assert [name for name in names if name not in text] == []


def test_the_parameter_tables_have_every_parameter_of_every_node(site):
    text = (site / 'reference' / 'nodes.html').read_text()
    for node in NODES.values():
        assert [one.name for one in node.table if f'<code>{one.name}</code>' not in text] == []


def test_it_can_be_searched(site):
    index = json.loads((site / 'search' / 'search_index.json').read_text())
    assert any('Stribeck' in entry['text'] for entry in index['docs'])


@pytest.mark.parametrize('name', ['first_model', 'missing_effect', 'trusting_the_numbers'])
def test_a_notebook_is_on_the_site_with_what_it_shows(name, site):
    text = (site / 'notebooks' / f'{name}.html').read_text()
    assert text.count('<img') >= 2
    assert f'href="{name}.ipynb"' in text
    written = json.loads((site / 'notebooks' / f'{name}.ipynb').read_text())
    assert any(cell.get('outputs') for cell in written['cells'])
    assert '<iframe' in text or '<table' in text
