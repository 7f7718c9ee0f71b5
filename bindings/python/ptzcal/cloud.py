"""Clouds of coloured points, and surfaces with pictures on them."""

from __future__ import annotations

import enum
from ctypes import byref, c_size_t, c_uint32, c_void_p
from typing import Any, Optional, Tuple, Union

import numpy as np

from . import _native, _structs
from ._arrays import address_of, address_of_optional, contiguous, point_covariances, rows, shaped, vector
from ._native import Handle, call, lib
from .camera import Camera
from .images import Image, PixelFormat, view
from .pictures import DepthMap
from .pose import Pose
from .scan import Scan

Format = Union[PixelFormat, str, int, None]

#: A Kinect's of the first kind, 1/m.
_KINECT = 0.001425


class CloudNoise(enum.IntEnum):
    """What is known of the noise of a cloud's points."""

    UNKNOWN = 0
    DEVIATIONS = 1  #: the root mean square distance of each point from its truth
    COVARIANCES = 2


def _copied(function: Any, cloud: Any, columns: int, dtype: Any = np.float64) -> np.ndarray:
    needed = c_size_t()
    # The first call tells the size, or why there are none.
    try:
        call(function, cloud._pointer, None, 0, byref(needed))
    except _native.Error:
        if not needed.value:
            raise
    values = np.empty((needed.value // columns, columns), dtype)
    call(function, cloud._pointer, address_of(values), values.size, None)
    return values


class Cloud(Handle):
    """Coloured points of the world."""

    _free = "ptzcal_cloud_free"

    def __init__(self, xyz: Any = None, *, rgb: Any = None, covariance: Any = None) -> None:
        """xyz: (n, 3), metres; the others as for `add`."""
        self._make(lib.ptzcal_cloud_new)
        self.skipped = 0  #: points of a file without finite coordinates
        if xyz is not None:
            self.add(xyz, rgb=rgb, covariance=covariance)

    @classmethod
    def _made(cls, function: Any, *arguments: Any) -> "Cloud":
        cloud = cls.__new__(cls)
        cloud.skipped = 0
        cloud._make(function, *arguments)
        return cloud

    @classmethod
    def from_scan(cls, scan: Scan) -> "Cloud":
        """The measured points, with colours and covariances."""
        return cls._made(lib.ptzcal_cloud_from_scan, scan._pointer)

    @classmethod
    def from_depth(
        cls,
        depth: DepthMap,
        camera: Camera,
        image: Optional[Image] = None,
        *,
        inverse_depth_sigma: float = _KINECT,
        depth_sigma: float = 0.001,
        format: Format = None,
    ) -> "Cloud":
        """The points of a depth map's pixels in the world of its camera's pose, coloured by its image.

        inverse_depth_sigma (1/m) and depth_sigma (metres): the depth camera's noise.
        """
        seen = None if image is None else view(image, format, "image")
        return cls._made(
            lib.ptzcal_cloud_from_depth_map,
            depth._pointer,
            byref(camera._struct),
            seen,
            inverse_depth_sigma,
            depth_sigma,
        )

    @classmethod
    def load(cls, path: _native.Path) -> "Cloud":
        """Reads .ply, .pcd, .glb or .wrl; `skipped` counts points that are NaN or infinite."""
        cloud, pointer, skipped = cls.__new__(cls), c_void_p(), c_size_t()
        call(lib.ptzcal_cloud_load, _native.path(path), byref(pointer), byref(skipped))
        cloud._pointer, cloud.skipped = pointer.value, skipped.value
        return cloud

    def save(self, path: _native.Path) -> None:
        """Writes .ply, .pcd, .glb or .wrl."""
        call(lib.ptzcal_cloud_save, self._pointer, _native.path(path))

    def add(self, xyz: Any, *, rgb: Any = None, covariance: Any = None) -> None:
        """Adds points (n, 3), metres. rgb: (n, 3), 0 to 255, white without. covariance: (n, 3, 3) or
        one (3, 3), m^2; all points of a cloud have one, or none has."""
        xyz = rows(xyz, 3, "xyz")
        colours = None
        if rgb is not None:
            colours = np.asarray(rgb)
            if colours.dtype != np.uint8 or colours.shape != xyz.shape:
                raise ValueError(f"rgb must be uint8 of shape {xyz.shape}, not {colours.dtype} of {colours.shape}")
            colours = np.ascontiguousarray(colours)
        covariances = point_covariances(covariance, len(xyz), "covariance")
        if covariances is not None:
            covariances = np.ascontiguousarray(covariances.reshape(-1, 9)[:, [0, 1, 2, 4, 5, 8]])
        call(
            lib.ptzcal_cloud_add_points,
            self._pointer,
            address_of(xyz),
            address_of_optional(colours),
            address_of_optional(covariances),
            len(xyz),
        )

    def merge(self, other: "Cloud") -> None:
        """Adds another cloud's points. Raises InvalidArgument when only one of the two knows its noise
        or has normals: `strip` the other."""
        call(lib.ptzcal_cloud_merge, self._pointer, other._pointer)

    def strip(self) -> None:
        """Forgets noise and normals."""
        call(lib.ptzcal_cloud_strip, self._pointer)

    def transform(self, R: Any, t: Any, covariance: Any = None) -> None:
        """X <- R X + t, covariances too. covariance: (6, 6) of the pose, as Pose.covariance."""
        pose = _native.initial(_structs.ptzcal_pose)
        pose.rotation[:] = shaped(R, 3, (3,), "R").ravel()
        pose.translation[:] = vector(t, 3, "t")
        s = None if covariance is None else shaped(covariance, 6, (6,), "covariance")
        call(lib.ptzcal_cloud_transform, self._pointer, byref(pose), address_of_optional(s))

    def transform_by(self, pose: Pose) -> None:
        """From station b's frame into station a's."""
        self.transform(pose.R, pose.t, pose.covariance)

    def crop(self, least: Any, greatest: Any) -> None:
        """Keeps the points inside a box, (3,) and (3,), metres."""
        low, high = vector(least, 3, "least"), vector(greatest, 3, "greatest")
        call(lib.ptzcal_cloud_crop, self._pointer, address_of(low), address_of(high))

    def thin(self, voxel: float) -> None:
        """One point, the weighted mean, for each cube of this side, metres."""
        call(lib.ptzcal_cloud_thin, self._pointer, voxel)

    def _size(self) -> Tuple[int, CloudNoise, bool]:
        points, noise, normals = c_size_t(), c_uint32(), c_uint32()
        call(lib.ptzcal_cloud_size, self._pointer, byref(points), byref(noise), byref(normals))
        return points.value, CloudNoise(noise.value), bool(normals.value)

    def __len__(self) -> int:
        return self._size()[0]

    @property
    def noise(self) -> CloudNoise:
        return self._size()[1]

    @property
    def xyz(self) -> np.ndarray:
        """A copy, (n, 3), metres."""
        return _copied(lib.ptzcal_cloud_copy_points, self, 3)

    @property
    def rgb(self) -> np.ndarray:
        """A copy, (n, 3), uint8."""
        return _copied(lib.ptzcal_cloud_copy_colours, self, 3, np.uint8)

    @property
    def normals(self) -> Optional[np.ndarray]:
        """A copy, (n, 3), unit vectors, zeros where there is none; None without normals."""
        return _copied(lib.ptzcal_cloud_copy_normals, self, 3) if self._size()[2] else None

    @property
    def deviations(self) -> Optional[np.ndarray]:
        """(n,), metres: root mean square distance of each point from its truth; None: unknown."""
        if self.noise == CloudNoise.UNKNOWN:
            return None
        return _copied(lib.ptzcal_cloud_copy_deviations, self, 1)[:, 0]

    @property
    def covariances(self) -> Optional[np.ndarray]:
        """(n, 3, 3), m^2; None where they are unknown."""
        if self.noise != CloudNoise.COVARIANCES:
            return None
        packed = _copied(lib.ptzcal_cloud_copy_covariances, self, 6)
        return packed[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)

    def depth_map(self, camera: Camera) -> DepthMap:
        """Depths of the nearest point in each pixel of a camera."""
        depth = DepthMap.__new__(DepthMap)
        depth._make(lib.ptzcal_cloud_depth_map, self._pointer, byref(camera._struct))
        return depth

    def __repr__(self) -> str:
        return f"<ptzcal.Cloud: {len(self)} points>"


def _surface(max_incidence: Optional[float], significance: Optional[float]) -> Any:
    options = _native.initial(_structs.ptzcal_surface_options)
    if max_incidence is not None:
        options.max_incidence = max_incidence
    if significance is not None:
        options.significance = significance
    return byref(options)


class Mesh(Handle):
    """Triangles between points, with pictures on them."""

    _free = "ptzcal_mesh_free"

    def __init__(self, vertices: Cloud, triangles: Any) -> None:
        """triangles: (n, 3), counter-clockwise for who sees the front."""
        indices = np.asarray(triangles)
        if indices.size == 0:
            indices = np.empty((0, 3), np.uint32)
        if indices.dtype.kind not in "iu" or indices.ndim != 2 or indices.shape[1] != 3:
            raise ValueError(f"triangles must be integers of shape (n, 3), not {indices.dtype} of {indices.shape}")
        if indices.size and (indices.min() < 0 or indices.max() >= len(vertices)):
            raise ValueError(f"triangles of points that are not among the {len(vertices)}")
        indices = contiguous(indices, np.uint32)
        self._make(lib.ptzcal_mesh_new, vertices._pointer, address_of(indices), len(indices))

    @classmethod
    def _made(cls, function: Any, *arguments: Any) -> "Mesh":
        mesh = cls.__new__(cls)
        mesh._make(function, *arguments)
        return mesh

    @classmethod
    def from_scan(
        cls,
        scan: Scan,
        *,
        max_incidence: Optional[float] = None,
        significance: Optional[float] = None,
    ) -> "Mesh":
        """The surface on the grid of a scan's positions. Edges steeper than max_incidence (radians)
        that neither side explains, by more than `significance` standard deviations, are cut."""
        return cls._made(lib.ptzcal_mesh_from_scan, scan._pointer, _surface(max_incidence, significance))

    @classmethod
    def from_depth(
        cls,
        depth: DepthMap,
        camera: Camera,
        image: Optional[Image] = None,
        *,
        inverse_depth_sigma: float = _KINECT,
        depth_sigma: float = 0.001,
        max_incidence: Optional[float] = None,
        significance: Optional[float] = None,
        format: Format = None,
    ) -> "Mesh":
        """The surface that a depth map shows, coloured by its camera's image."""
        seen = None if image is None else view(image, format, "image")
        return cls._made(
            lib.ptzcal_mesh_from_depth_map,
            depth._pointer,
            byref(camera._struct),
            seen,
            inverse_depth_sigma,
            depth_sigma,
            _surface(max_incidence, significance),
        )

    @classmethod
    def load(cls, path: _native.Path) -> "Mesh":
        """Reads .glb, .wrl or .ply."""
        return cls._made(lib.ptzcal_mesh_load, _native.path(path))

    def save(self, path: _native.Path) -> None:
        """Writes .glb, .wrl, or .ply, which has no pictures."""
        call(lib.ptzcal_mesh_save, self._pointer, _native.path(path))

    def add_picture(self, image: Image, camera: Camera, *, format: Format = None) -> None:
        """A picture for `texture`, and where it was taken from."""
        call(
            lib.ptzcal_mesh_add_picture,
            self._pointer,
            view(image, format, "image"),
            byref(camera._struct),
        )

    def texture(self) -> int:
        """Puts the pictures on; each triangle gets the one that shows it best. How many got one."""
        covered = c_size_t()
        call(lib.ptzcal_mesh_texture, self._pointer, byref(covered))
        return covered.value

    def _size(self) -> Tuple[int, int, int]:
        sizes = c_size_t(), c_size_t(), c_size_t()
        call(lib.ptzcal_mesh_size, self._pointer, *map(byref, sizes))
        return sizes[0].value, sizes[1].value, sizes[2].value

    @property
    def textures(self) -> int:
        """Pictures that are on it."""
        return self._size()[2]

    @property
    def vertices(self) -> Cloud:
        """A copy of the points."""
        return Cloud._made(lib.ptzcal_mesh_vertices, self._pointer)

    @property
    def triangles(self) -> np.ndarray:
        """A copy, (n, 3), uint32."""
        return _copied(lib.ptzcal_mesh_copy_triangles, self, 3, np.uint32)

    def depth_map(self, camera: Camera) -> DepthMap:
        """Depths of the surface in a camera's image."""
        depth = DepthMap.__new__(DepthMap)
        depth._make(lib.ptzcal_mesh_depth_map, self._pointer, byref(camera._struct))
        return depth

    def __repr__(self) -> str:
        vertices, triangles, textures = self._size()
        return f"<ptzcal.Mesh: {triangles} triangles of {vertices} points, {textures} pictures>"
