# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pages of notebooks, which are executed at every build of the site."""

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
    Return the page of a notebook with the output of its cells, and its files by name.

    The files are its pictures, and the notebook itself as .ipynb.

    It runs in its own folder, as in an editor.

    Parameters
    ----------
    path : Path
        A script in jupytext's percent format.

    Raises
    ------
    nbclient.exceptions.CellExecutionError
        Where a cell fails, with the cell and the traceback.

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
    """Make the kernel import this tree, and write nothing to the home directory."""
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
