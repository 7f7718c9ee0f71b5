"""Cameras in the files of other programs: OpenCV, ROS, COLMAP, mrcal, Kalibr."""

from __future__ import annotations

import enum
from ctypes import byref, c_size_t, c_uint32
from dataclasses import dataclass
from typing import Any, List, Optional, Sequence, Union

from . import _native, _structs
from ._arrays import member
from ._native import Handle, call, lib
from .camera import Camera


class CameraFormat(enum.IntEnum):
    """File formats of cameras. AUTO: the content tells when reading, the ending when writing."""

    AUTO = 0
    JSON = 1  #: our own, to the last bit
    OPENCV_YAML = 2  #: FileStorage, the keys of OpenCV's calibration sample
    OPENCV_XML = 3
    OPENCV_JSON = 4
    ROS = 5  #: camera_info; has no pose
    COLMAP = 6  #: a folder with a model as text; any number of cameras
    MRCAL = 7  #: .cameramodel
    KALIBR = 8  #: camchain; any number of cameras, whose world is the first one's frame


@dataclass(frozen=True)
class NamedCamera:
    """A camera of a file."""

    camera: Camera
    name: str = ""
    #: False when the file did not say where the camera is: its pose means nothing.
    has_pose: bool = True


class _List(Handle):
    _free = "ptzcal_camera_list_free"

    def __init__(self, function: Any, *arguments: Any) -> None:
        self._make(function, *arguments)


def _format(value: Any) -> CameraFormat:
    return member(CameraFormat, value, "format")


def read_cameras(
    path: _native.Path, format: Union[CameraFormat, str, int] = CameraFormat.AUTO
) -> List[NamedCamera]:
    """Reads all cameras of a file, or of COLMAP's folder.

    Raises Error FILE_IO, FILE_FORMAT (the message names line and key), FILE_VERSION, or UNSUPPORTED
    for a lens that is not here.
    """
    cameras = _List(lib.ptzcal_camera_list_read, _native.path(path), _format(format))
    count = c_size_t()
    call(lib.ptzcal_camera_list_count, cameras._pointer, byref(count), None)
    found = []
    for i in range(count.value):
        struct, has_pose = _native.initial(_structs.ptzcal_camera), c_uint32()
        call(lib.ptzcal_camera_list_get, cameras._pointer, i, byref(struct), byref(has_pose))
        name = lib.ptzcal_camera_list_name(cameras._pointer, i).decode()
        found.append(NamedCamera(Camera._from_struct(struct), name, bool(has_pose.value)))
    return found


def read_camera(
    path: _native.Path, format: Union[CameraFormat, str, int] = CameraFormat.AUTO
) -> Camera:
    """Reads the one camera of a file; as read_cameras, and Error AMBIGUOUS for several."""
    struct = _native.initial(_structs.ptzcal_camera)
    call(lib.ptzcal_camera_read, _native.path(path), _format(format), byref(struct))
    return Camera._from_struct(struct)


def write_cameras(
    path: _native.Path,
    cameras: Union[Camera, Sequence[Union[Camera, NamedCamera]]],
    format: Union[CameraFormat, str, int] = CameraFormat.AUTO,
) -> None:
    """Writes one camera, or several where the format holds them.

    Raises Error UNSUPPORTED for what the format cannot hold; it is never rounded to what it can.
    """
    written = _List(lib.ptzcal_camera_list_new)
    for one in [cameras] if isinstance(cameras, Camera) else cameras:
        camera, name = (one, None) if isinstance(one, Camera) else (one.camera, one.name)
        text: Optional[bytes] = None if name is None else name.encode()
        call(lib.ptzcal_camera_list_add, written._pointer, byref(camera._struct), text)
    call(lib.ptzcal_camera_list_write, written._pointer, _native.path(path), _format(format))
