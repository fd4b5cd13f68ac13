# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The linters that `colcon test` runs on a ROS 2 machine pass on this tree.

ament_copyright is not among them: it does not know the SPDX lines that files begin with.

"""

import pytest

FOLDERS = ('armid_ros', 'benchmarks', 'docsite', 'examples', 'launch', 'scripts', 'tests')


@pytest.fixture
def folders(root):
    return [str(root / name) for name in FOLDERS]


def test_flake8(root, folders):
    main = pytest.importorskip('ament_flake8.main').main
    assert main(argv=['--config', str(root / 'ament_flake8.ini'), *folders]) == 0


def test_pep257(folders):
    """Run the ament linter with its own settings."""
    main = pytest.importorskip('ament_pep257.main').main
    assert main(argv=folders) == 0


def test_xmllint(root):
    """The XML linter downloads the schema; without a network the test is skipped."""
    main = pytest.importorskip('ament_xmllint.main').main
    assert main(argv=[str(root / 'package.xml'), str(root / 'msg_schemas' / 'package.xml')]) == 0
