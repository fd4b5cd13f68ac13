# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How many mutants are tried, and the table of what became of them."""

import os
from pathlib import Path

from hypothesis import HealthCheck, Phase, settings
from hypothesis.database import DirectoryBasedExampleDatabase

from tests.fuzz.property import TALLY

#: Mutants of each kind that pytest tries; up to as many are always the same ones.
USUAL = 300
WANTED = int(os.environ.get('ARMID_FUZZ', USUAL))

settings.register_profile(
    'armid',
    max_examples=WANTED,
    derandomize=WANTED <= USUAL,
    database=None
    if WANTED <= USUAL
    else DirectoryBasedExampleDatabase(Path(__file__).with_name('failures')),
    deadline=None,
    suppress_health_check=list(HealthCheck),
    phases=[Phase.explicit, Phase.reuse, Phase.generate, Phase.shrink],
    report_multiple_bugs=True,
    print_blob=True,
)
settings.load_profile('armid')

_COLUMNS = (
    'mutants',
    'refused',
    'same',
    'said',
    'other',
    'SILENT',
    'other exception',
    'too long',
    'too much memory',
)


def pytest_terminal_summary(terminalreporter):
    """Print what became of the mutants of each kind."""
    if not TALLY:
        return
    terminalreporter.section('mutants')
    terminalreporter.line(f'{"kind":22}' + ''.join(f'{name:>17}' for name in _COLUMNS))
    for kind, counts in TALLY.items():
        row = ''.join(f'{counts[name]:17}' for name in _COLUMNS)
        terminalreporter.line(f'{kind:22}{row}')
