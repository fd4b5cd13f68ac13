# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The Dockerfile is one that a linter finds nothing in, and it copies what is there."""

from pathlib import Path
import re
import subprocess
import sys


def test_the_linter_finds_nothing(root):
    command = [Path(sys.prefix, 'bin', 'hadolint'), root / 'Dockerfile']
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_what_it_names_in_the_tree_is_there(root):
    text = (root / 'Dockerfile').read_text()
    for path in re.findall(r'src/armid_ros/([\w./]+)', text):
        assert (root / path).exists(), path
    for script in (root / 'docker').iterdir():
        assert script.stat().st_mode & 0o111 == 0o111
        assert subprocess.run(['bash', '-n', script]).returncode == 0


def test_nothing_that_was_built_goes_into_the_image(root):
    """What is left out of the repository is left out of the image, too."""
    ignored = (root / '.dockerignore').read_text().split()
    assert {'.git', '.venv', 'build', 'install', 'log', 'dist'} <= set(ignored)
