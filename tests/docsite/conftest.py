# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The files that pages and docstrings talk about."""

import shutil

import pytest

from docsite.desk import lay_out


@pytest.fixture(scope='session')
def desk(tmp_path_factory):
    """Make them once."""
    return lay_out(tmp_path_factory.mktemp('desk'))


@pytest.fixture
def at_desk(desk, tmp_path, monkeypatch):
    """Work in a copy of them."""
    folder = shutil.copytree(desk, tmp_path / 'desk')
    monkeypatch.chdir(folder)
    return folder
