# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page of measured speeds, from the last results of ``make bench``."""

import json
from pathlib import Path

_BEGINNING = """# Speed

Each block is what a benchmark printed when it was last run. Ratios compare both sides in one run
on one machine; seconds are of that machine. `make bench BENCH=NAME` runs it again.

## Growth

`python -m benchmarks.growth` measures the jobs as the data grow. Elsewhere there are 7 joints, one
recording of 12 s at 1 kHz and two effects. The slope is the exponent over the upper half.

![Processor time and memory over samples, joints, bags and effects](../images/growth.png)
"""


def speed_page(results: Path) -> str:
    """
    Return the page.

    Parameters
    ----------
    results : Path
        File of names with machine, commit and the lines that were printed.

    Returns
    -------
    str
        Markdown.

    """
    parts = [_BEGINNING]
    for name, found in json.loads(results.read_text(encoding='utf-8')).items():
        printed = '\n'.join(found['lines'])
        parts.append(
            f'## {name}\n\n{found["machine"]}, commit `{found["commit"]}`:\n\n'
            f'```text\n{printed}\n```\n'
        )
    return '\n'.join(parts)
