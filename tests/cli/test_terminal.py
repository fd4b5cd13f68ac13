# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a log sees of long work."""

import re

from armid_ros.cli.terminal import progress_line, say
import click
from click.testing import CliRunner
import pytest


@pytest.mark.parametrize(
    ('share', 'numbers'),
    [(0.25, (25, 10, 30)), (0.5, (50, 10, 10)), (0.0, (0, 10)), (1.0, (100, 10))],
)
def test_a_line_of_progress_has_share_time_and_time_to_go(share, numbers):
    line = progress_line('identifying', share, 10.0)
    assert line.startswith('identifying: ')
    assert tuple(map(int, re.findall(r'\d+', line))) == numbers
    assert 'to go' not in progress_line('identifying', share, 10.0, steady=False)


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
