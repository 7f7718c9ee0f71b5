"""Puts the library and its laser guard into the wheel.

`pip install ./bindings/python` builds them with cargo, unless ptzcal/ holds them already. Who installs the
wheel needs neither a compiler nor anything else but NumPy.
"""

import functools
import re
import shutil
import subprocess
from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py

HERE = Path(__file__).resolve().parent
PROJECT = HERE.parent.parent
FILES = "libptzcal.so", "ptzcal-laser-guard"


@functools.cache
def built():
    """The library and the guard, built where they are not there."""
    shipped = [HERE / "ptzcal" / name for name in FILES]
    if shipped[0].exists():
        return [path for path in shipped if path.exists()]
    if not (PROJECT / "Cargo.toml").exists():
        raise SystemExit("neither ptzcal/libptzcal.so nor the sources that it is built from are here")
    if shutil.which("cargo") is None:
        raise SystemExit("cargo is missing: install Rust from https://rustup.rs, or put a built libptzcal.so into ptzcal/")
    folder = subprocess.run(["make", "-s", "wheel-files"], cwd=PROJECT, check=True, stdout=subprocess.PIPE, text=True)
    return [Path(folder.stdout.strip().splitlines()[-1]) / name for name in FILES]


class BuildWithLibrary(build_py):
    def run(self):
        super().run()
        target = Path(self.build_lib) / "ptzcal"
        target.mkdir(parents=True, exist_ok=True)
        for path in built():
            copy = target / path.name
            shutil.copy2(path, copy)
            if shutil.which("strip"):
                subprocess.run(["strip", "--strip-unneeded", str(copy)], check=True)


class Wheel(bdist_wheel):
    """For every Python 3, and every Linux with the C library that the files need (PEP 600)."""

    def get_tag(self):
        platform = super().get_tag()[2]
        if platform.startswith("linux_"):
            needed = [re.findall(rb"GLIBC_2\.(\d+)", path.read_bytes()) for path in built()]
            minor = max((int(version) for versions in needed for version in versions), default=0)
            if minor:
                platform = platform.replace("linux_", f"manylinux_2_{minor}_")
        return "py3", "none", platform


class Binary(Distribution):
    def has_ext_modules(self):
        return True


setup(cmdclass={"build_py": BuildWithLibrary, "bdist_wheel": Wheel}, distclass=Binary)
