# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Documentation pages of notebooks, which every build of the site executes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import os
from pathlib import Path
from tempfile import TemporaryDirectory

import jupytext
from nbconvert import MarkdownExporter
from nbconvert.preprocessors import ExecutePreprocessor

#: Largest time of a cell [s], which ends a notebook that hangs.
CELL_TIMEOUT = 600


def executed(path: Path) -> tuple[str, dict[str, bytes]]:
    """
    Execute a notebook in its own folder; return its page with outputs, and its files by name.

    The files are the pictures of the page, and the notebook as .ipynb.

    Parameters
    ----------
    path : Path
        A script in jupytext's percent format.

    Raises
    ------
    nbclient.exceptions.CellExecutionError
        If a cell fails; the message has the cell and the traceback.

    """
    notebook = jupytext.read(path)
    with _own_kernel():
        run = ExecutePreprocessor(timeout=CELL_TIMEOUT, startup_timeout=CELL_TIMEOUT)
        run.preprocess(notebook, {'metadata': {'path': str(path.parent)}})
    file = f'{path.stem}.ipynb'
    exporter = MarkdownExporter()
    names = {'unique_key': path.stem, 'output_files_dir': 'pictures'}
    markdown, resources = exporter.from_notebook_node(notebook, resources=names)
    link = f'[Download this page as a notebook]({file})\n\n'
    files = {**resources['outputs'], file: jupytext.writes(notebook, fmt='ipynb').encode()}
    return link + markdown, files


@contextmanager
def _own_kernel() -> Iterator[None]:
    """Let a kernel import this repository, and write nothing to the home directory."""
    before = dict(os.environ)
    folders = (str(Path(__file__).parents[1]), before.get('PYTHONPATH', ''))
    with TemporaryDirectory() as folder:
        os.environ |= {
            'PYTHONPATH': os.pathsep.join(filter(None, folders)),
            'JUPYTER_RUNTIME_DIR': folder,
            'IPYTHONDIR': folder,
        }
        try:
            yield
        finally:
            os.environ.clear()
            os.environ.update(before)
