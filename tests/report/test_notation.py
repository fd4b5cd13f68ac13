# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Labels leave out what all names of an arm begin with, and nothing else."""

from armid_ros.report.blocks import BarChart, ContentSection, DataTable, Paragraph
from armid_ros.report.notation import common_prefix
from armid_ros.report.page import Page
import pytest

PANDA = tuple(f'panda_joint{number}' for number in range(1, 8))


@pytest.mark.parametrize(
    ('names', 'prefix'),
    [
        (PANDA, 'panda_'),
        (('lbr_iiwa_joint_1', 'lbr_iiwa_joint_2'), 'lbr_iiwa_'),
        (('joint_1', 'joint_2'), ''),
        (('ur_pan', 'ur_lift'), ''),
        (('panda_joint1',), ''),
    ],
)
def test_a_long_prefix_before_a_letter_is_common(names, prefix):
    assert common_prefix(names) == prefix


def test_labels_of_a_page_have_short_names_and_sentences_whole_ones():
    label = f'friction, {", ".join(PANDA)}'
    blocks = (
        Paragraph('See panda_joint3.'),
        DataTable(('Joint',), [('panda_joint2',), ('bags/panda_joint2',), ('panda_joint21',)]),
        BarChart([(label, [])], full=1.0),
    )
    page = Page('', '', [ContentSection('A', blocks)], charts=False, names=PANDA).html()
    for text in ('See panda_joint3', '>joint2<', 'bags/panda_joint2', '>panda_joint21<'):
        assert text in page
    assert '7 joints' in page and page.count('panda_<') <= 1
    assert '>panda_joint2<' in blocks[1].html()
