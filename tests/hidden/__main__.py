# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""``python -m tests.hidden calibrate|list|write``: sizes, names and bags of the hidden cases."""

from __future__ import annotations

import argparse
from pathlib import Path

from tests.hidden.calibration import calibrate_all
from tests.hidden.cases import make_case, write_case
from tests.hidden.specification import case_list, find_case, SETS


def main() -> None:
    """Run one job."""
    parser = argparse.ArgumentParser(prog='python -m tests.hidden')
    jobs = parser.add_subparsers(dest='job', required=True)
    calibrating = jobs.add_parser('calibrate', help='find the sizes that sizes.json lacks')
    listing = jobs.add_parser('list', help='print the names of the cases')
    for job in (calibrating, listing):
        job.add_argument('sets', nargs='*', default=list(SETS))
    calibrating.add_argument('--processes', type=int, default=2)
    writing = jobs.add_parser('write', help='write the recordings of a case as bags')
    writing.add_argument('key')
    writing.add_argument('folder', type=Path)
    options = parser.parse_args()
    if options.job == 'write':
        write_case(make_case(find_case(options.key)), options.folder)
        return
    specs = [spec for name in options.sets for spec in case_list(name)]
    if options.job == 'list':
        print(*(spec.key for spec in specs), sep='\n')
    else:
        calibrate_all(specs, options.processes)


if __name__ == '__main__':
    main()
