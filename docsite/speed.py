# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The documentation page of measured speeds, from the last results of ``make bench``."""

import json
from pathlib import Path

_BEGINNING = """# Speed

Each block on this page shows the lines that a benchmark printed in its last run. A ratio of speeds
compares two programs in one run on one machine. `make bench BENCH=NAME` repeats a benchmark.

## Growth

`python -m benchmarks.growth` measures processor time and memory over the size of the input. Inputs
that do not grow have 7 joints, one recording of 12 s at 1 kHz, and two effects. The slope of a
curve is the exponent of its growth, fitted to the upper half.

![Processor time and memory over samples, joints, bags and effects](../images/growth.png)
"""


def speed_page(results: Path) -> str:
    """
    Return a Markdown page with the results of the benchmarks.

    Parameters
    ----------
    results : Path
        JSON file with machine, commit and printed lines of each benchmark, by name.

    """
    parts = [_BEGINNING]
    for name, found in json.loads(results.read_text(encoding='utf-8')).items():
        printed = '\n'.join(found['lines'])
        parts.append(
            f'## {name}\n\n{found["machine"]}, commit `{found["commit"]}`:\n\n'
            f'```text\n{printed}\n```\n'
        )
    return '\n'.join(parts)
