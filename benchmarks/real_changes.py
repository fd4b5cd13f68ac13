# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Changes of real machines between two days, and their diagnoses.

A model is identified on day 1; the recordings of day 2 are diagnosed, and those of day 1 again.
The true changes are known: see benchmarks/real_days.py.

    python -m benchmarks.real_changes [TEXT ...]    # only the questions that have one of the texts

"""

from __future__ import annotations

from pathlib import Path
import sys
import tempfile

from armid_ros.errors import ArmidError

from benchmarks.real_days import DAYS
from benchmarks.real_recordings import folder
from benchmarks.two_days import ask, identification_of


def main() -> None:
    """Print the true changes, and the answers below them."""
    texts = sys.argv[1:]
    with tempfile.TemporaryDirectory() as out:
        for name, load in DAYS.items():
            if texts and not any(text in name for text in texts):
                continue
            days = load(folder(), Path(out))
            print(f'\n{days.name}\n    wanted   {days.wanted}')
            for what, recordings, validate in (
                ('day 2', days.day_2, days.held_out),
                ('day 1', days.day_1, ()),
            ):
                try:
                    arm = identification_of(days.robot, days.day_1).arm
                    answer = ask(arm, recordings, validate=validate, baseline=days.day_1)
                except ArmidError as error:
                    print(f'    {what}    refused: {error}')
                    continue
                names = '; '.join(map(str, answer.headline))
                print(
                    f'    {what}    {answer.verdict:14s} {names} [{answer.seconds:.1f} s]',
                    flush=True,
                )


if __name__ == '__main__':
    main()
