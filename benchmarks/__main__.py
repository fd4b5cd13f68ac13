# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Run benchmarks by name, or all: ``python -m benchmarks [NAME ...]``.

The output of the benchmarks of speed is kept in results/speed.json; the docs show it.

"""

import json
from pathlib import Path
import subprocess
import sys

from benchmarks.metrics import processor

BENCHMARKS = (
    *('changes', 'coverage', 'exo', 'exo_diagnosis', 'growth'),
    *('healthy_arms', 'hidden_effects', 'live_diagnosis', 'lived', 'nodes'),
    *('offline_speed', 'online', 'part_time', 'reading', 'real_changes', 'real_diagnosis'),
    'simulation',
)
#: Benchmarks whose output is kept.
SPEED = {'nodes', 'offline_speed', 'online', 'reading', 'simulation'}
RESULTS = Path(__file__).parent / 'results' / 'speed.json'


def run(name: str) -> int:
    """Run a benchmark in a separate process, record its printed lines; return its exit code."""
    command, lines = [sys.executable, '-m', f'benchmarks.{name}'], []
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            print(line, end='', flush=True)
            lines.append(line.rstrip())
    if name in SPEED and process.returncode == 0:
        head = ['git', 'rev-parse', '--short', 'HEAD']
        commit = subprocess.run(head, capture_output=True, text=True).stdout.strip()
        kept = json.loads(RESULTS.read_text(encoding='utf-8')) if RESULTS.exists() else {}
        kept[name] = {'machine': processor(), 'commit': commit, 'lines': lines}
        RESULTS.write_text(json.dumps(kept, indent=1, sort_keys=True) + '\n', encoding='utf-8')
    return process.returncode


def main() -> int:
    """Run the benchmarks named on the command line, or all of them."""
    names = sys.argv[1:] or BENCHMARKS
    unknown = [name for name in names if name not in BENCHMARKS]
    if unknown:
        print(f"benchmarks: no '{unknown[0]}'; there are {', '.join(BENCHMARKS)}", file=sys.stderr)
        return 2
    failed = 0
    for name in names:
        print(f'== {name}', flush=True)
        failed |= run(name)
    return failed


sys.exit(main())
