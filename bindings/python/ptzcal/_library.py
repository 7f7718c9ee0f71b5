"""Finds and loads the shared library."""

from __future__ import annotations

import ctypes
import os
import sys
from pathlib import Path
from typing import List

#: PTZCAL_ABI_VERSION of the header that this package was written for.
ABI_VERSION = 1


def _names() -> List[str]:
    if sys.platform == "win32":
        return ["ptzcal.dll"]
    if sys.platform == "darwin":
        return [f"libptzcal.{ABI_VERSION}.dylib", "libptzcal.dylib"]
    return [f"libptzcal.so.{ABI_VERSION}", "libptzcal.so"]


def load() -> ctypes.CDLL:
    """The library that PTZCAL_LIBRARY names, else the one beside this file, else the system's."""
    named = os.environ.get("PTZCAL_LIBRARY")
    if named:
        candidates = [named]
    else:
        folder = Path(__file__).parent
        beside = [str(folder / name) for name in _names() if (folder / name).exists()]
        candidates = beside or _names()
    tried = []
    for candidate in candidates:
        try:
            library = ctypes.CDLL(candidate)
        except OSError as error:
            tried.append(f"  {candidate}: {error}")
            continue
        _check_abi(library, candidate)
        return library
    raise ImportError(
        "the ptzcal library could not be loaded:\n"
        + "\n".join(tried)
        + "\nInstall it where the system's loader looks, copy it into "
        + f"{Path(__file__).parent}, or set PTZCAL_LIBRARY to its full path."
    )


def _check_abi(library: ctypes.CDLL, path: str) -> None:
    try:
        version = library.ptzcal_abi_version
    except AttributeError:
        raise ImportError(
            f"{path} is not the ptzcal library: it has no ptzcal_abi_version"
        ) from None
    version.restype, version.argtypes = ctypes.c_uint32, []
    if version() != ABI_VERSION:
        raise ImportError(
            f"{path} has ABI {version()}, but this ptzcal package wants ABI {ABI_VERSION}: "
            "install the package and the library of the same version"
        )
