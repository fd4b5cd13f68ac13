# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Run benchmarks by name, or all but the longest: ``python -m benchmarks [NAME ...]``."""

from pathlib import Path
import subprocess
import sys

LIBRARY = {
    '__init__',
    '__main__',
    'bic_selection',
    'browser',
    'elastic',
    'exo_noise',
    'exo_poses',
    'laboratory_scoring',
    'leg_pair_in_mujoco',
    'lived_questions',
    'lived_scoring',
    'looks',
    'metrics',
    'real_days',
    'real_recordings',
    'two_days',
}
#: Run only when they are asked for: they take an hour.
LONG = {'endurance'}


def main() -> int:
    """Run each in a process of its own, with memory and threads of its own."""
    known = sorted(
        path.stem for path in Path(__file__).parent.glob('*.py') if path.stem not in LIBRARY
    )
    names = sys.argv[1:] or [name for name in known if name not in LONG]
    unknown = [name for name in names if name not in known]
    if unknown:
        print(f"benchmarks: no '{unknown[0]}'; there are {', '.join(known)}", file=sys.stderr)
        return 2
    failed = 0
    for name in names:
        print(f'== {name}', flush=True)
        failed |= subprocess.run([sys.executable, '-m', f'benchmarks.{name}']).returncode
    return failed


sys.exit(main())
