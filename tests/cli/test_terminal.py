# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a log sees of long work."""

from armid_ros.cli.terminal import ProgressLines


def test_progress_without_a_terminal_is_a_line_every_ten_seconds():
    now, lines = [100.0], []
    progress = ProgressLines('reading', lines.append, lambda: now[0])
    for second in range(1, 31):
        now[0] = 100.0 + second
        progress.tick(second / 40.0, 'identifying' if second > 5 else None)
        progress.look()
    assert lines == [
        'identifying: 25 %, 10 s',
        'identifying: 50 %, 20 s',
        'identifying: 75 %, 30 s',
    ]


def test_work_that_says_nothing_is_still_shown_to_go_on():
    now, lines = [0.0], []
    progress = ProgressLines('drawing', lines.append, lambda: now[0])
    now[0] = 25.0
    progress.look()
    progress.look()
    assert lines == ['drawing: 0 %, 25 s']


def test_the_watch_ends_with_the_work():
    progress = ProgressLines('reading', print, lambda: 0.0)
    with progress.watched():
        progress.tick(0.5)
