# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The number of mutants, and the table of their outcomes."""

import os
from pathlib import Path

from hypothesis import HealthCheck, Phase, settings
from hypothesis.database import DirectoryBasedExampleDatabase

from tests.fuzz.property import TALLY

#: Default number of mutants of each kind; up to this number, mutants are the same in each run.
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
    """Print the outcomes of the mutants of each kind."""
    if not TALLY:
        return
    terminalreporter.section('mutants')
    terminalreporter.line(f'{"kind":22}' + ''.join(f'{name:>17}' for name in _COLUMNS))
    for kind, counts in TALLY.items():
        row = ''.join(f'{counts[name]:17}' for name in _COLUMNS)
        terminalreporter.line(f'{kind:22}{row}')
