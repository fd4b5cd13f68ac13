# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Commands and nodes of other packages are found by entry points, as effects are."""

from importlib.metadata import EntryPoint
import sys
import types

from armid_ros.cli import commands, main, node
from armid_ros.plug_ins import plug_ins
import click
from click.testing import CliRunner
import pytest


@click.command(epilog='Example: armid greet --times 2')
@click.option('--times', default=1.0)
def greet(times):
    """Say hello."""
    click.echo(f'hello {times:g}')


@pytest.fixture
def installed(monkeypatch):
    """Install modules with a command, a node, a command that fails, and one that was deleted."""

    def entries(group):
        kind = group.rpartition('.')[2]
        names = {'commands': ('greet', 'broken', 'deleted'), 'nodes': ('waver',)}[kind]
        return [EntryPoint(name, f'of_others.{name}:{name}', group) for name in names]

    modules = {name: types.ModuleType(name) for name in ('of_others', 'of_others.greet')}
    modules['of_others.broken'] = types.ModuleType('of_others.broken')
    modules['of_others.waver'] = types.ModuleType('of_others.waver')
    for name, module in modules.items():
        module.__spec__ = types.SimpleNamespace()
        monkeypatch.setitem(sys.modules, name, module)
    modules['of_others'].__path__ = []
    modules['of_others.greet'].greet = greet
    modules['of_others.waver'].waver = types.SimpleNamespace(main=lambda: 3)
    monkeypatch.setattr('importlib.metadata.entry_points', entries)
    for cached in (commands._imported, plug_ins):
        cached.cache_clear()
    yield
    for cached in (commands._imported, plug_ins):
        cached.cache_clear()


def run(*arguments):
    """Run a command; return its exit code and all that it says."""
    result = CliRunner().invoke(main, arguments)
    return result.exit_code, result.output


def test_a_command_is_listed_and_run_and_refuses_what_is_not_finite(installed):
    assert 'greet' in run('--help')[1] and 'Say hello.' in run('--help')[1]
    assert run('greet', '--times', '2') == (0, 'hello 2\n')
    for number in ('nan', 'inf', '-inf'):
        code, said = run('greet', '--times', number)
        assert code == 2 and "'--times'" in said and number in said


def test_a_command_that_fails_names_its_package_and_breaks_no_other(installed):
    code, said = run('broken')
    assert code == 2
    assert 'of_others.broken' in said and 'AttributeError' in said
    assert 'of_others.broken' in run('--help')[1]


def test_a_command_whose_module_was_deleted_is_none(installed):
    assert 'deleted' not in run('--help')[1]
    assert run('deleted')[0] == 2


def test_a_node_is_run_by_its_name(installed):
    assert node.main('waver') == 3
