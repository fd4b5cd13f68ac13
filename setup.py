# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Package armid_ros for pip and for colcon alike."""

from glob import glob
from pathlib import Path
import zlib

from setuptools import Extension, find_packages, setup

HERE = Path(__file__).resolve().parent  # `colcon build --symlink-install` runs a link to this file
NAME = 'armid_ros'
PLUG_INS = (
    *(Path(NAME, room) for room in ('fleet', 'positions', 'view', 'zero')),
    *sorted(Path(NAME, 'papers').glob('*/')),
)
NODES = sorted(path.name for path in (HERE / 'scripts').iterdir() if path.name != 'armid')


def requirements(group):
    """Read requirements/<group>.in: one requirement a line, after a '#' a comment."""
    lines = (HERE / 'requirements' / f'{group}.in').read_text(encoding='utf-8').splitlines()
    names = (line.split('#')[0].strip() for line in lines)
    return [name for name in names if name and not name.startswith('-')]


def package_data():
    """List what lies in the package's tree and is not Python."""
    files = sorted(path for path in Path(NAME).rglob('*') if path.is_file())
    return [
        str(path.relative_to(NAME)) for path in files if path.suffix not in ('.py', '.pyc', '.so')
    ]


def commands():
    """List the command of every plug-in that is there, in its command.py, and that of a clone."""
    found = [path for path in PLUG_INS if (path / 'command.py').is_file()]
    # benchmarks are not installed; `make armid-bench` puts a clone on the path
    return [
        *(f'{path.name} = {".".join(path.parts)}.command:{path.name}' for path in found),
        'bench = benchmarks.bench:bench',
    ]


def nodes():
    """List the nodes of the plug-ins that are there, by the names of their modules."""
    found = [path for folder in PLUG_INS for path in sorted(folder.glob('nodes/[!_]*.py'))]
    return [f'{path.stem} = {".".join(path.with_suffix("").parts)}' for path in found]


def shared(folder):
    """List (folder in share/armid_ros, its files) for all that is below a folder of the tree."""
    files = sorted(
        path for path in Path(folder).rglob('*') if path.is_file() and path.suffix != '.pyc'
    )
    return [(f'share/{NAME}/{path.parent.as_posix()}', [path.as_posix()]) for path in files]


def kernel():
    """Describe the compiled kernel; without a compiler, Python computes the same, more slowly."""
    source = Path(NAME, 'model', 'kernel.c')
    checksum = zlib.crc32(source.read_bytes())  # is compared when the kernel is loaded
    return Extension(
        f'{NAME}.model._kernel',
        [str(source)],
        define_macros=[('CHECKSUM', f'{checksum}L')],
        extra_compile_args=['-O3'],
        optional=True,
    )


setup(
    name=NAME,
    version='0.1.0',
    description='Dynamic identification of robot arms: excite, record, identify, and find what '
    'the model lacks.',
    long_description=(HERE / 'README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
    author='The armid_ros developers',
    author_email='armid_ros@example.org',
    maintainer='The armid_ros developers',
    maintainer_email='armid_ros@example.org',
    license='Apache-2.0',
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    package_data={NAME: package_data()},
    ext_modules=[kernel()],
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        *shared('launch'),
        *shared('config'),
        # pip puts console_scripts into bin/, where `ros2 run` does not look
        (f'lib/{NAME}', sorted(glob('scripts/*'))),
    ],
    python_requires='>=3.11',
    install_requires=requirements('run'),
    extras_require={
        'ros': requirements('ros'),
        'convert': requirements('convert'),
        'view': requirements('view'),
        'notebook': requirements('notebook'),
        'fleet': requirements('fleet'),
        'residual': requirements('residual'),
        'mujoco': requirements('mujoco'),
        'test': requirements('test'),
        'bench': requirements('bench'),
    },
    zip_safe=False,
    entry_points={
        'console_scripts': [
            f'armid = {NAME}.cli:main',
            *(f'{node} = {NAME}.cli.node:main' for node in NODES),
        ],
        f'{NAME}.commands': commands(),
        f'{NAME}.nodes': nodes(),
    },
)
