# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Fixtures with the files that examples in pages and docstrings use."""

import shutil

import pytest

from docsite.desk import lay_out


@pytest.fixture(scope='session')
def desk(tmp_path_factory):
    """Write the files once; return their folder."""
    return lay_out(tmp_path_factory.mktemp('desk'))


@pytest.fixture
def at_desk(desk, tmp_path, monkeypatch):
    """Change to a copy of the folder of files, and return it."""
    folder = shutil.copytree(desk, tmp_path / 'desk')
    monkeypatch.chdir(folder)
    return folder
