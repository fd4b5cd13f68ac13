# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Wheel and source distribution have all files that users need, and no others."""

from email.parser import HeaderParser
import os
import shutil
import subprocess
import sys
import tarfile
from zipfile import ZipFile

import armid_ros
import pytest

BUILD = 'import sys; from setuptools import build_meta; print(build_meta.{}(sys.argv[1]))'
LEFT_OUT = ('.*', 'build', 'dist', '*.egg-info', '__pycache__', 'node_modules', 'site')
#: Folder that `armid demo` fills in the current folder; not the room of that name.
DEMO = 'demo'


def built(step, source, out):
    """Run a step of `python -m build` with the installed build libraries."""
    command = [sys.executable, '-c', BUILD.format(step), out]
    environment = {**os.environ, 'PYTHONWARNINGS': 'ignore'}
    subprocess.run(command, cwd=source, env=environment, check=True, capture_output=True)
    (made,) = out.iterdir()
    return made


@pytest.fixture(scope='module')
def sdist(root, tmp_path_factory):
    """Build the source distribution of the tree; return its path."""
    folder = tmp_path_factory.mktemp('sdist')
    by_name = shutil.ignore_patterns(*LEFT_OUT)

    def ignored(place, names):
        return by_name(place, names) | ({DEMO} if place == str(root) else set())

    shutil.copytree(root, folder / 'tree', ignore=ignored)
    (folder / 'out').mkdir()
    return built('build_sdist', folder / 'tree', folder / 'out')


@pytest.fixture(scope='module')
def wheel(sdist, tmp_path_factory):
    """Build a wheel from the source distribution alone; return its path."""
    folder = tmp_path_factory.mktemp('wheel')
    with tarfile.open(sdist) as archive:
        filters = {'filter': 'data'} if hasattr(tarfile, 'data_filter') else {}  # not in 3.11.2
        archive.extractall(folder / 'source', **filters)
    (source,) = (folder / 'source').iterdir()
    (folder / 'out').mkdir()
    return ZipFile(built('build_wheel', source, folder / 'out'))


@pytest.mark.slow
def test_the_wheel_holds_every_file_of_the_package(root, wheel):
    package = root / 'armid_ros'
    wanted = {
        path.relative_to(root).as_posix()
        for path in package.rglob('*')
        if path.is_file() and '__pycache__' not in path.parts
    }
    inside = {name for name in wheel.namelist() if name.startswith('armid_ros/')}
    assert inside == wanted
    assert {'armid_ros/py.typed', 'armid_ros/report/assets/report.css'} <= inside


def test_the_wheel_has_no_tests_and_nothing_beside_the_package(wheel):
    tops = {name.split('/')[0] for name in wheel.namelist()}
    data = f'armid_ros-{armid_ros.__version__}.data'
    assert tops == {'armid_ros', data, data.replace('.data', '.dist-info')}
    assert not [name for name in wheel.namelist() if 'test_' in name.rsplit('/', 1)[-1]]


def test_the_wheel_brings_what_ros_looks_for(root, wheel):
    data = {name.partition('.data/data/')[2] for name in wheel.namelist() if '.data/' in name}
    assert 'share/ament_index/resource_index/packages/armid_ros' in data
    assert 'share/armid_ros/package.xml' in data
    launches = {f'share/armid_ros/launch/{path.name}' for path in (root / 'launch').glob('*.py')}
    scripts = {f'lib/armid_ros/{path.name}' for path in (root / 'scripts').iterdir()}
    assert launches | scripts <= data


def test_the_wheel_says_what_it_needs(wheel):
    (name,) = (name for name in wheel.namelist() if name.endswith('.dist-info/METADATA'))
    facts = HeaderParser().parsestr(wheel.read(name).decode())
    assert facts['Version'] == armid_ros.__version__
    assert facts['Requires-Python'] == '>=3.11'
    assert {'ros', 'convert', 'view', 'notebook'} <= set(facts.get_all('Provides-Extra'))
    needed = facts.get_all('Requires-Dist')
    always = [one for one in needed if 'extra ==' not in one]
    assert any(one.startswith('pin') for one in always)
    assert not any('ros-jazzy' in one or 'rerun' in one for one in always)
    assert facts['Description-Content-Type'] == 'text/markdown'


def test_the_source_builds_the_messages_too(sdist):
    with tarfile.open(sdist) as archive:
        names = {name.partition('/')[2] for name in archive.getnames()}
    wanted = ('msg_schemas/msg/ParameterEstimate.msg', 'package.xml', 'LICENSE', 'Makefile')
    assert set(wanted) <= names
    assert not [name for name in names if name.startswith(('tests/', '.venv', 'build/'))]
