# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a log sees of long work."""

import re

from armid_ros.cli.terminal import ProgressLines, say
import click
from click.testing import CliRunner
import pytest


def test_progress_without_a_terminal_is_a_line_every_ten_seconds():
    now, lines = [100.0], []
    progress = ProgressLines('reading', lines.append, lambda: now[0])
    for second in range(1, 31):
        now[0] = 100.0 + second
        progress.tick(second / 40.0, 'identifying' if second > 5 else None)
        progress.look()
    now[0] += 25.0  # work that says nothing is still shown to go on
    progress.look()
    progress.look()
    shown = [tuple(map(int, re.findall(r'\d+', line))) for line in lines]
    assert shown == [(25, 10, 30), (50, 20, 20), (75, 30, 10), (75, 55, 18)]  # %, s, s to go
    assert all(line.startswith('identifying: ') for line in lines)


@pytest.mark.parametrize(
    ('terminal', 'colour', 'shown'),
    [
        (True, 'green', '\x1b[32mfit \\x1b[31m\x1b[0m\n'),
        (False, 'green', 'fit \\x1b[31m\n'),
        (False, None, 'fit \\x1b[31m\n'),
    ],
)
def test_a_colour_is_for_terminals_and_escapes_of_a_text_are_shown(terminal, colour, shown):
    """Colours are of terminals; text of a file has no say in it."""
    command = click.Command('excite', callback=lambda: say('fit \x1b[31m', colour))
    assert CliRunner().invoke(command, color=terminal).output == shown
