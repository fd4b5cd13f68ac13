# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every block of code on a page runs, or states why it cannot."""

import json
import os
from pathlib import Path
import re
import subprocess
import sys

from armid_ros.cli import main
import click
import pytest
import yaml

from docsite.blocks import blocks, LANGUAGES, RUN, script, starts_with

ROOT = Path(__file__).parents[2]
PAGES = [
    ROOT / 'README.md',
    *sorted((ROOT / 'docs').rglob('*.md')),
    *sorted((ROOT / 'bags').glob('*.md')),
    *sorted((ROOT / 'examples').glob('*.md')),
]


def name_of(page):
    return str(page.relative_to(ROOT))


def runs(page):
    return any(block.language in RUN and not block.excuse for block in blocks(page))


@pytest.mark.parametrize('page', PAGES, ids=name_of)
def test_every_block_has_a_language_that_says_what_is_done_with_it(page):
    for block in blocks(page):
        assert block.language in LANGUAGES, f'{name_of(page)}:{block.line} {block.text[:60]}'
        assert block.language in RUN or not block.excuse, f'{name_of(page)}:{block.line}'


@pytest.mark.parametrize('page', PAGES, ids=name_of)
def test_blocks_of_data_can_be_read(page):
    for block in blocks(page):
        if block.language == 'yaml':
            assert yaml.safe_load(block.text) is not None, f'{name_of(page)}:{block.line}'
        if block.language == 'json':
            assert json.loads(block.text) is not None, f'{name_of(page)}:{block.line}'


@pytest.mark.long
@pytest.mark.parametrize('page', [page for page in PAGES if runs(page)], ids=name_of)
def test_the_blocks_of_a_page_run_one_after_the_other(page, at_desk):
    for path in at_desk.iterdir():
        if starts_with(page) is not None and path.name not in starts_with(page):
            path.rename(at_desk.parent / path.name)
    folders = [str(ROOT), os.environ.get('PYTHONPATH', '')]
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ['PATH']])
    done = subprocess.run(
        ['bash', '-c', script(blocks(page))],
        env={**os.environ, 'PATH': path, 'PYTHONPATH': os.pathsep.join(filter(None, folders))},
        cwd=at_desk,
        capture_output=True,
        encoding='utf-8',
        check=False,
    )
    assert done.returncode == 0, f'{name_of(page)}: {done.stdout[-2000:]}{done.stderr[-2000:]}'
    for name in re.findall(r'`(\w+/\w+\.html)`', page.read_text(encoding='utf-8')):
        made = at_desk / name
        assert made.is_file() or not made.parent.is_dir(), f'{name_of(page)}: no {name}'


def options():
    """Return the names of all options of all armid commands."""
    context = click.Context(main)
    return {
        option
        for command in commands_of(main, context)
        for parameter in command.get_params(context)
        for option in (*parameter.opts, *parameter.secondary_opts)
    }


def commands_of(group, context):
    """Yield all commands of a group and of its subgroups."""
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        yield command
        if isinstance(command, click.Group):
            yield from commands_of(command, context)


@pytest.mark.parametrize('page', PAGES, ids=name_of)
def test_every_option_that_a_page_names_exists(page):
    """Options of other programs are allowed after the name of the program."""
    text = re.sub(r'^```.*?^```$', '', page.read_text(encoding='utf-8'), flags=re.M | re.S)
    texts = [
        code
        for code in re.findall(r'`([^`\n]+)`', text)
        if not code.startswith(('python -m', 'python3 -m', 'colcon ', 'pip '))
    ]
    named = {option for code in texts for option in re.findall(r'(?<!\S)--[a-z][\w-]*', code)}
    assert named <= {*options(), '--ros-args'}


def test_a_block_that_fails_is_noticed(tmp_path):
    page = tmp_path / 'page.md'
    page.write_text('```bash\nfalse\n```\n\n```python\nprint(1)\n```\n')
    assert subprocess.run(['bash', '-c', script(blocks(page))], check=False).returncode == 1


def test_blocks_are_found_with_their_excuses(tmp_path):
    page = tmp_path / 'page.md'
    page.write_text('<!-- not run: why -->\n```bash\nls\n```\n\n    indented\n')
    first, second = blocks(page)
    assert (first.line, first.language, first.text, first.excuse) == (2, 'bash', 'ls', 'why')
    assert (second.line, second.language) == (6, 'indented')
    assert 'ls' not in script(blocks(page))
