# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Started processes never import modules from the current folder."""

import os
from pathlib import Path
import subprocess
import sys
import textwrap

import armid_ros
import pytest

STARTS = {
    'the program of identification_run': """
        from armid_ros.nodes.identification_run import start_program
        assert start_program(('--help',)).wait(60) == 0
        """,
    'the assistant of live_diagnosis': """
        from armid_ros.nodes.live.assistant import Assistant
        assistant = Assistant()
        assistant.ask('plan', 0)
        assert assistant._pipe.poll(60)
        assert str(assistant.poll()) == 'no diagnosis is complete so far; keep the arm moving'
        assistant.close()
        """,
    'the workers of a fleet': """
        from armid_ros.fleet.cluster import connected
        if __name__ == '__main__':
            with connected(None, 1) as client:
                assert client.submit(sum, (1, 2)).result(60) == 3
        """,
    'the expansion of a xacro': """
        from pathlib import Path
        from armid_ros.robots.xacro_expansion import expand_xacro
        Path('arm.xacro').write_text('<robot name="arm"/>')
        assert 'arm' in expand_xacro(Path('arm.xacro'), {}, {})
        """,
}


@pytest.mark.slow
@pytest.mark.parametrize('start', STARTS.values(), ids=STARTS)
def test_a_module_in_the_current_folder_is_not_executed(tmp_path, start):
    driver = tmp_path / 'driver' / 'driver.py'
    driver.parent.mkdir()
    driver.write_text(textwrap.dedent(start))
    current = tmp_path / 'current'
    current.mkdir()
    for name in (*sys.stdlib_module_names, 'numpy', 'click', 'dask', 'armid_ros', 'xacro'):
        trap = f'open({str(tmp_path / "executed")!r}, "a").write(__name__ + " ")\nraise SystemExit'
        (current / f'{name}.py').write_text(trap)
    environment = os.environ | {'PYTHONPATH': str(Path(armid_ros.__file__).parents[1])}
    command = [sys.executable, driver]
    subprocess.run(command, cwd=current, env=environment, check=True, timeout=120)
    assert not Path(tmp_path / 'executed').exists()
