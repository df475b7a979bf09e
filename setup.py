"""How the package is installed: by pip, by colcon, or both from one tree."""

from pathlib import Path

from setuptools import find_packages, setup

NAME = "xy_sysid"
HOME = "https://github.com/xy-sysid/xy_sysid"  # also in package.xml
ROS_WHEELS = "sys_platform == 'linux' and platform_machine == 'x86_64'"
# importlib-metadata: dask needs it on Python 3.11; version 10 needs one more package
FLEET = ["dask[distributed]", "pyarrow", "bokeh", "importlib-metadata<9"]
ISAL = "isal; platform_machine in 'x86_64 AMD64 aarch64 arm64'"  # fast checksums; elsewhere zlib's will do


def files(*patterns: str) -> list[str]:
    """Paths relative to this file, the way setuptools wants them."""
    here = Path(__file__).parent
    return sorted(str(path.relative_to(here)) for pattern in patterns for path in here.glob(pattern))


setup(
    name=NAME,
    version="0.1.0",
    description="Live identification of an XY table over ROS 2, and the same from a recording",
    author="xy_sysid contributors",
    maintainer="xy_sysid maintainers",
    maintainer_email="xy-sysid@users.noreply.github.com",
    url=f"{HOME}#readme",
    project_urls={"Repository": HOME, "Bugtracker": f"{HOME}/issues"},
    license="Apache-2.0",
    python_requires=">=3.11,<3.14",
    packages=find_packages(include=["xy_sysid", "xy_sysid.*", "xy_sim", "xy_sim.*"]),
    package_data={"xy_sysid": ["py.typed", "**/*.html", "**/*.js", "**/*.css", "**/*.yaml"], "xy_sim": ["py.typed", "**/*.yaml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/config", files("config/*.yaml", "config/*.xml", "config/*.json", "config/*.md")),
        (f"share/{NAME}/config/machines", files("config/machines/*.yaml")),
        (f"share/{NAME}/launch", files("launch/*.py")),
        ("share/man/man1", ["docs/xy-sysid.1"]),
    ],
    zip_safe=False,
    install_requires=["numpy", "scipy", "numba", "rosbags", "pydantic>=2", "typer", "rich>=14.1", "plotly", "threadpoolctl", "pyyaml", ISAL],
    extras_require={
        "ros": [
            f"ros-jazzy-rclpy[fastrtps]==7.1.6; {ROS_WHEELS}",
            f"ros-jazzy-common-interfaces==5.3.6; {ROS_WHEELS}",
        ],
        "page": ["nicegui>=3.13,<4"],
        "figures": ["matplotlib"],
        "frames": ["pandas"],
        "control": ["control"],
        "docs": ["mkdocs-material", "mkdocstrings[python]", "nbclient", "ipykernel", "latex2mathml"],
        "mat73": ["h5py"],
        "mf4": ["asammdf"],
        "tdms": ["npTDMS"],
        "ulog": ["pyulog"],
        "wpilog": ["robotpy-wpiutil"],
        "parquet": ["pyarrow"],
        "mujoco": ["mujoco"],
        "fleet": FLEET,
        "bench": ["scikit-rf", "pyFRF"],
        "test": [
            "matplotlib",
            "pandas",
            "nicegui>=3.13,<4",
            "playwright",
            "pypdfium2",
            "pytest",
            "pytest-xdist",
            "hypothesis",
            "blark",
            "ruff",
            "proselint",
            "mypy",
            "scipy-stubs",
            "types-PyYAML",
            "pre-commit",
            "joblib",
            "control",
            "h5py",
            "asammdf",
            "npTDMS",
            "pyulog",
            f"robotpy-wpiutil; {ROS_WHEELS}",
            *FLEET,
            "duckdb",
            "polars",
            "mujoco",
            "FMPy",
            f"drake; {ROS_WHEELS}",
            "colcon-core",
            "colcon-ros",
            "colcon-bash",
        ],
    },
    entry_points={
        "console_scripts": [
            "xy-sysid = xy_sysid.cli:main",
            "excitation = xy_sysid.nodes.excitation:main",
            "identifier = xy_sysid.nodes.identifier:main",
            "diagnoser = xy_sysid.nodes.diagnoser:main",
            "recorder = xy_sysid.nodes.recorder:main",
            "ballscrew = xy_sim.node:main",
        ],
    },
)
