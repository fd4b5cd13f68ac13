# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a log sees of long work."""

from pathlib import Path

import armid_ros.cli
from armid_ros.cli.terminal import print_rows, ProgressLines, say
import click
from click.testing import CliRunner
import pytest

ROW = {
    'joint': 'a_joint_of_a_long_name',
    'from [rad]': '-1.22',
    'to': '0.0396',
    'moving': '100 %',
    'value, 95 %': '0.20003 ± 0.00011 kg m²',
    'note': 'words that may be broken where there is no room for all of them',
}


def test_tables_say_their_units_and_break_no_number(capsys, monkeypatch):
    monkeypatch.setenv('COLUMNS', '80')
    print_rows([ROW], as_json=False, right=('from [rad]', 'to', 'value, 95 %'), spare=('moving',))
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert 'from [rad]' in lines[0]
    assert 'moving' not in lines[0]
    assert '0.20003 ± 0.00011 kg m²' in lines[1]


@pytest.mark.parametrize('colour', [None, 'green'])
def test_a_line_without_a_terminal_has_no_colour_and_no_escapes(capsys, colour):
    """Colours are of terminals; text of a file has no say in it."""
    say('fit \x1b[31m', colour)
    assert capsys.readouterr().out == 'fit \\x1b[31m\n'


def test_progress_without_a_terminal_is_a_line_every_ten_seconds():
    now, lines = [100.0], []
    progress = ProgressLines('reading', lines.append, lambda: now[0])
    for second in range(1, 31):
        now[0] = 100.0 + second
        progress.tick(second / 40.0, 'identifying' if second > 5 else None)
        progress.look()
    assert lines == [
        'identifying: 25 %, 10 s, about 30 s to go',
        'identifying: 50 %, 20 s, about 20 s to go',
        'identifying: 75 %, 30 s, about 10 s to go',
    ]


def test_work_that_says_nothing_is_still_shown_to_go_on():
    now, lines = [0.0], []
    progress = ProgressLines('drawing', lines.append, lambda: now[0])
    now[0] = 25.0
    progress.look()
    progress.look()
    assert lines == ['drawing: 0 %, 25 s']


@pytest.mark.parametrize(
    ('terminal', 'shown'), [(True, '\x1b[32mfit to run\x1b[0m\n'), (False, 'fit to run\n')]
)
def test_a_colour_is_for_terminals_and_leaves_no_codes_in_a_pipe(terminal, shown):
    command = click.Command('excite', callback=lambda: say('fit to run', 'green'))
    assert CliRunner().invoke(command, color=terminal).output == shown


def test_no_command_styles_what_it_says_itself():
    """What is said is made visible, escape codes included, so colours belong to `say`."""
    for path in Path(armid_ros.cli.__file__).parent.glob('*.py'):
        assert 'say(click.style' not in path.read_text(), path.name
