# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How much of a cause without a name a learned map predicts, and which law it suggests.

Arms that have lived (tests/hidden/lived) with a cause that no catalogue has. The diagnosis is
asked and its verdict is printed; what is learned is all that the model leaves, as if there were no
name. What can be explained is what the true contribution of the cause takes off the squares that
the model leaves of the held-out recording; what is reached is the part of it that the map takes.
Counted are recordings that come near the data in half of their rows and show the cause there: it
makes half of what the model leaves.

    python -m benchmarks.residual [FIRST:LAST]

"""

from __future__ import annotations

from dataclasses import replace
import sys
import time

from armid_ros.diagnosis import diagnose
from armid_ros.residual import learn_residual
from armid_ros.residual.learn import near_data
from armid_ros.residual.rows import joint_rows
import numpy as np

from benchmarks.two_days import identification_of
from tests.hidden.lived.adapter import recording_of, robot_of
from tests.hidden.lived.cases import case_with
from tests.hidden.lived.specification import SIZES

CAUSES = ('position_friction', 'cubic_drag', 'cable_snag', 'bumps')


def held_out_squares(learned, parts, joint, t, contribution):
    """
    Return squares of a held-out recording where it comes near the data, and the share of that.

    Those that the model leaves, that it leaves of the recording without the cause, and that it
    leaves with the map.

    """
    k = learned.base.robot.joints.index(joint)
    rows = joint_rows(learned.base, parts)[k]
    there = [
        part.reduce(np.interp(part.motion.t, t, contribution[:, k]))[part.informative[:, k]]
        for part in parts
    ]
    own = next((one.learned for one in learned.joints if one.joint == joint), None)
    if own is None:
        return np.sum(rows.left**2), 0.0, np.sum(rows.left**2), 0.0
    near = near_data(own, rows)
    left, cause = rows.left[near], np.concatenate(there)[near]
    after = left - own.torque(rows.inputs[near])
    return np.sum(left**2), np.sum((left - cause) ** 2), np.sum(after**2), np.mean(near)


def judge(cause, index):
    """Make a case, diagnose it, learn what is left; print a line."""
    case = case_with('development', index, cause, SIZES['clear'])
    before, today = ([recording_of(run) for run in day] for day in (case.day_1, case.day_2))
    held_out = recording_of(case.held_out)
    arm = identification_of(robot_of(case), before).arm
    rng = np.random.default_rng(0)
    found = diagnose(arm, today, validate=[held_out], baseline=before, rng=rng)
    verdict, named = found.verdict, ','.join(one.name for one in found.findings)
    plain = replace(found.explanation, fitted=found.explanation.reference)
    asked = replace(found, verdict='unknown', findings=(), arm=arm, explanation=plain)
    begin = time.process_time()
    learned = learn_residual(asked, rng)
    seconds = time.process_time() - begin
    joint = case.truth[0].joints[0]
    line = f'{cause:18s} {index:3d} {case.spec.arm:12s} {verdict:9s} {named:22s}'
    if learned is None:
        print(f'{line} nothing learned')
        return np.nan
    parts = [overlay.trajectory for overlay in asked.gap.overlays]
    old, best, new, near = held_out_squares(
        learned, parts, joint, case.held_out.t, case.held_out.contribution
    )
    shown = near > 0.5 and best < 0.5 * old
    reached = (old - new) / (old - best) if shown else np.nan
    law = next((one.law for one in learned.joints if one.joint == joint), None)
    said = 'no law' if law is None else f'{law.text} ({100 * law.share:.0f} %)'
    shares = ' '.join(f'{100 * (1 - after / max(old, 1e-300)):5.0f} %' for after in (best, new))
    print(
        f'{line} {100 * near:4.0f} % {shares} {100 * reached:5.0f} % {seconds:5.1f} s  {said}',
        flush=True,
    )
    return reached


def main():
    """Print a line a case, and the medians."""
    first, _, last = (sys.argv[1] if len(sys.argv) > 1 else '0:6').partition(':')
    print(
        'cause, case, arm, verdict, names; held-out rows near the data; share of the squares there'
    )
    print('that can be explained, that the map takes, and the second over the first; time; law')
    for cause in CAUSES:
        reached = []
        for index in range(int(first), int(last)):
            try:
                reached.append(judge(cause, index))
            except RuntimeError as error:
                print(f'{cause} {index} left out: {error}', flush=True)
        shown = np.array(reached)[np.isfinite(reached)]
        print(
            f'{cause}: {len(shown)} of {len(reached)} held-out recordings show it; reached '
            f'{100 * np.median(shown):.0f} % in the median, half or more in '
            f'{np.sum(shown >= 0.5)} of {len(shown)}',
            flush=True,
        )


if __name__ == '__main__':
    main()
