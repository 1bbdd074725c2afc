"""Packages are found, not listed: every folder with an ``__init__.py`` joins the namespace ``motion_cueing``.

The folders at the top are installed as one namespace, since a bare ``envs`` or ``train`` in site-packages
would collide with users' own folders. Everything else stands in pyproject.toml.
"""

from setuptools import find_packages, setup

TOP = ("envs", "baselines", "train", "evaluation", "realtime", "cli")
PACKAGES = [name for top in TOP for name in (top, *(f"{top}.{sub}" for sub in find_packages(top)))]

setup(
    packages=[
        f"motion_cueing.{name}"
        for top in TOP
        for name in [top, *(f"{top}.{sub}" for sub in find_packages(top))]
    ],
    package_dir={f"motion_cueing.{top}": top for top in TOP},
)
