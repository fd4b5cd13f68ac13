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
from armid_ros.recording import Recording

from benchmarks.real_days import DAYS, RealDays
from benchmarks.real_recordings import folder
from benchmarks.two_days import Answer, ask, identification_of


def answers(days: RealDays) -> tuple[Answer, Answer]:
    """Return the answers of the diagnosis for day 2, and for day 1 again."""
    try:
        arm = identification_of(days.robot, days.day_1).arm
    except ArmidError as error:
        refused = Answer('no model', error=str(error))
        return refused, refused

    def said(recordings: tuple[Recording, ...], validate: tuple[Recording, ...]) -> Answer:
        try:
            return ask(arm, recordings, validate=validate, baseline=days.day_1)
        except ArmidError as error:
            return Answer('refused', error=str(error))

    return said(days.day_2, days.held_out), said(days.day_1, ())


def main() -> None:
    """Print the true changes, and the answers below them."""
    texts = sys.argv[1:]
    with tempfile.TemporaryDirectory() as out:
        for name, load in DAYS.items():
            if texts and not any(text in name for text in texts):
                continue
            days = load(folder(), Path(out))
            print(f'\n{days.name}\n    wanted   {days.wanted}')
            for what, answer in zip(('day 2', 'day 1'), answers(days), strict=True):
                print(
                    f'    {what}    {answer.verdict:14s} {"; ".join(map(str, answer.headline))} '
                    f'[{answer.seconds:.1f} s] {answer.error}',
                    flush=True,
                )
                if answer.verdict == 'bad_data':
                    print(f'             {answer.summary}')
                if answer.minor:
                    print(f'             minor: {"; ".join(map(str, answer.minor))}')


if __name__ == '__main__':
    main()
