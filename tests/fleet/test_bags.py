# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which bags a URL with wildcards stands for, whose they are, and of which day."""

from armid_ros.errors import FleetError
from armid_ros.fleet.bags import find_bags, folder_of
import pytest


@pytest.fixture
def store(tmp_path):
    """Return bags as files and as folders, and other things beside them."""
    for path in (
        'line_1/arm_a/2026-01-05/run.mcap',
        'line_1/arm_a/2026-01-06/run.db3',
        'line_1/arm_b/20260107/rosbag2_x/rosbag2_x_0.mcap',
        'line_1/arm_b/20260107/rosbag2_x/metadata.yaml',
        'line_1/arm_b/notes.txt',
        'line_1/arm_b/video/film.mp4',
        f'line_2/{"长" * 84}/run.mcap',
        f'line_2/{"机械臂" * 9}长/run.mcap',
    ):
        file = tmp_path / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(b'x' * 10)
    return tmp_path


def test_the_arm_is_what_the_first_wildcard_stands_for(store):
    bags = find_bags([f'{store}/line_1/*/*/*'])
    assert [(bag.arm, bag.day) for bag in bags] == [
        ('arm_a', '2026-01-05'),
        ('arm_a', '2026-01-06'),
        ('arm_b', '2026-01-07'),
    ]


def test_where_the_wildcard_is_the_bag_the_arm_is_its_folder(store):
    (bag,) = find_bags([f'{store}/line_1/arm_a/2026-01-05/*.mcap'])
    assert bag.arm == '2026-01-05'


def test_a_pattern_says_which_part_of_a_url_is_the_arm(store):
    bags = find_bags([f'{store}/line_1/**/*.mcap'], r'arm_(\w+)/')
    assert [bag.arm for bag in bags] == ['a', 'b']


def test_a_name_in_any_script_fits_into_the_name_of_a_folder(store):
    (bag,) = find_bags([f'{store}/line_2/机*/*'])
    assert len(bag.arm) == 28
    (store / folder_of(bag.arm)).mkdir()


def test_a_folder_that_is_a_bag_counts_once_and_its_files_do_not(store):
    bags = find_bags([f'{store}/line_1/arm_b/**'], r'(arm_\w)')
    assert [bag.url.rsplit('/', 1)[-1] for bag in bags] == ['rosbag2_x']


def test_the_version_changes_with_the_bag(store):
    (before,) = find_bags([f'{store}/line_1/arm_a/2026-01-05/*'])
    (store / 'line_1/arm_a/2026-01-05/run.mcap').write_bytes(b'x' * 11)
    (after,) = find_bags([f'{store}/line_1/arm_a/2026-01-05/*'])
    assert before.version != after.version
    assert before.name == after.name


@pytest.mark.parametrize(
    ('pattern', 'regular', 'said'),
    [
        ('/nowhere/*/*', None, 'there is no bag'),
        ('gopher://host/*', None, 'gopher'),
        ('{store}/line_1/*/*/*', 'arm', r'add a \(group\)'),
        ('{store}/line_1/*/*/*', 'robot_(.)', 'does not match'),
        ('{store}/line_1/*/*/*', '(', '--arm'),
        ('{store}/line_1/*/*/*', '/line_1/()', '--arm'),
        ('{store}/line_1/*/*/*', '(none)?', '--arm'),
        ('{store}/line_2/长*/*', None, '--arm'),
    ],
)
def test_what_cannot_be_listed_is_said_in_one_line(store, pattern, regular, said):
    with pytest.raises(FleetError, match=said):
        find_bags([pattern.format(store=store)], regular)
