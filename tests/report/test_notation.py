# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Labels leave out what all names of an arm begin with, and nothing else."""

from armid_ros.report.blocks import DataTable, Paragraph
from armid_ros.report.notation import common_prefix
from armid_ros.report.page import Page, Section
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
    others = 'bags/panda_joint2', 'panda_joint2.mcap', 'panda_joint21'
    blocks = (
        Paragraph('See panda_joint3.'),
        DataTable(('Joint',), [(one,) for one in ('panda_joint2', *others)]),
    )
    page = Page('', '', Paragraph(''), [Section('A', blocks)], names=PANDA).html()
    for text in ('See panda_joint3', '>joint2<', *(f'>{one}<' for one in others)):
        assert text in page
