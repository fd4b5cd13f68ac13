# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The demo of the command, and the browser that looks at its page."""

from __future__ import annotations

import json
from pathlib import Path

from armid_ros.papers.elastic.command import elastic
from click.testing import CliRunner
import pytest

from tests.report.conftest import browser, charts_drawn

__all__ = ['browser', 'charts_drawn', 'demo']


@pytest.fixture(scope='session')
def demo(tmp_path_factory) -> Path:
    """Simulate three experiments and the steps, and identify them."""
    out = tmp_path_factory.mktemp('elastic') / 'result'
    arguments = ['--demo', '--experiments', '3', '--out', str(out), '--json']
    result = CliRunner().invoke(elastic, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    assert json.loads(result.stdout) == json.loads((out / 'elastic.json').read_text())
    return out
