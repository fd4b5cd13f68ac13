# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Rate of right names and spans for a payload that is picked up and put down.

The arms are those of tests/hidden/lived with a payload throughout. Its torque is subtracted
outside of a span that is drawn for each recording.

    python -m benchmarks.part_time [DRAWS]

"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import count, islice
import sys

from armid_ros.diagnosis import diagnose, Diagnosis
import numpy as np

from benchmarks.two_days import identification_of
from tests.hidden.lived.cases import lived_case, LivedCase
from tests.hidden.lived.specification import specify

#: Ranges of the beginning and of the length of a span, as shares of the recording.
BEGINS, LASTS = (0.15, 0.4), (0.3, 0.45)
#: Largest accepted error of a beginning or an end [s].
WITHIN = 1.0


def payloads() -> Iterator[LivedCase]:
    """Yield the development cases in which a payload was added."""
    for k in count():
        if specify('development', k).cause == 'payload':
            yield lived_case('development', k)


def answer(case: LivedCase, seed: int) -> tuple[Diagnosis, list[tuple[float, float]]]:
    """Diagnose an arm; also return the true time span of the payload in each recording [s]."""
    rng = np.random.default_rng(seed)
    day_1, recordings, spans = [run.recording for run in case.day_1], [], []
    for run in (*case.day_2, case.held_out):
        whole = run.recording
        length = whole.t[-1] - whole.t[0]
        start = whole.t[0] + length * rng.uniform(*BEGINS)
        stop = start + length * rng.uniform(*LASTS)
        outside = (whole.t < start) | (whole.t > stop)
        tau = whole.tau - run.contribution * outside[:, np.newaxis]
        recordings.append(replace(whole, tau=tau))
        spans.append((float(start), float(stop)))
    found = diagnose(
        identification_of(case.robot, day_1).arm,
        recordings[:-1],
        validate=recordings[-1:],
        baseline=day_1,
        rng=np.random.default_rng(0),
    )
    return found, spans


def main() -> None:
    """Print the named effects and the errors of their time spans."""
    draws = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    named = timed = 0
    for seed, case in enumerate(islice(payloads(), draws)):
        found, spans = answer(case, seed)
        pairs = zip(found.spans, spans, strict=False)
        off = [max(abs(own.start - a), abs(own.stop - b)) for own, (a, b) in pairs]
        right = [one.name for one in found.findings][:1] == ['payload']
        named += right
        timed += right and len(off) >= len(spans) - 1 and max(off) <= WITHIN
        names = '; '.join(f'{one.name} {",".join(one.joints)}' for one in found.findings)
        errors = ', '.join(f'{one:.2f}' for one in off)
        print(f'gap {case.gap:5.2g}  {found.verdict:10} {names or "nothing"}  off [{errors}] s')
    print(f'payload named first in {named} of {draws}, all seconds within {WITHIN:g} s in {timed}')


if __name__ == '__main__':
    main()
