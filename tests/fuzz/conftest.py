# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The number of mutants."""

import os
from pathlib import Path

from hypothesis import HealthCheck, Phase, settings
from hypothesis.database import DirectoryBasedExampleDatabase

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
