# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every number that decides a name stands in the documentation as it is in the code."""

from dataclasses import fields
from pathlib import Path
import re

from armid_ros.diagnosis.settings import Thresholds

PAGE = Path(__file__).parents[2] / 'docs' / 'diagnosis.md'
ROW = re.compile(r'^\| (?P<names>`\w+`(?:, `\w+`)*) \| (?P<values>[\d.]+(?:, [\d.]+)*) \|')


def test_every_threshold_is_in_the_documentation_with_its_value():
    told = {}
    for line in PAGE.read_text().splitlines():
        row = ROW.match(line)
        if row:
            names = re.findall(r'`(\w+)`', row['names'])
            told |= dict(zip(names, map(float, row['values'].split(', ')), strict=True))
    assert told == {field.name: float(field.default) for field in fields(Thresholds)}
