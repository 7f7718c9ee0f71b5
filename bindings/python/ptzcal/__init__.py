"""Calibrates surveillance cameras with a pan-tilt-zoom camera and a laser pointer.

A binding of libptzcal: arrays in, arrays out. Lengths are metres, angles radians, times seconds,
image positions pixels; pixel (0, 0) is the centre of the top-left pixel. Calls release the GIL.
"""

from ._native import abi_version, version
from .adjust import Adjusted, Adjustment, RigParameter, Suspect
from .angle_map import AngleMap, AngleSummary, SureAngles
from .boards import (
    BoardCalibration,
    Boards,
    BoardView,
    LaserCalibration,
    calibrate_from_boards,
    calibrate_laser_line,
)
from .calibrate import (
    Calibration,
    Correspondences,
    calibrate_camera,
    division_eigenproblem,
    radial_alignment,
)
from .camera import Camera, DistortionModel
from .cancel import Cancel
from .chessboard import Chessboard, detect_chessboard
from .detect import LaserColour, Spot, SpotOptions, detect_spot
from .errors import (
    Cancelled,
    ChessboardAmbiguous,
    ChessboardNotFound,
    Error,
    InvalidArgument,
    SpotAmbiguous,
    SpotNotFound,
    Status,
)
from .head import (
    Focus,
    Head,
    HeadCapabilities,
    HeadIdentity,
    MoveEnd,
    MoveEvent,
    PanTiltZoom,
)
from .images import PixelFormat
from .lines import (
    LineFit,
    LineMatches,
    LineSegments,
    detect_edges,
    detect_line_segments,
    fit_line_3d,
    lift_line_segments,
    match_lines,
)
from .pictures import DepthMap, Picture, read_image
from .planes import (
    Plane,
    Planes,
    PlanesNotFound,
    StationPose,
    StationsAmbiguous,
    StationsNotMatched,
    common_roof_edges,
    register_matched_planes,
    register_stations,
)
from .pose import Pose, PoseMethod, RoofEdges, estimate_pose_roof_edges
from .probe import Figure, ProbeFigure, ProbeReport, learn_angles, probe
from .rgbd import Rgbd, RgbdLinePairs, RgbdPairs, RgbdView
from .rig import LogLevel, Rig, Settle
from .rig_calibration import (
    CommonLine,
    RigCalibrated,
    RigCalibration,
    RigView,
    UncertainRig,
    ZoomCurve,
    ZoomPosition,
)
from .rig_model import PanTilt, RigModel
from .scan import FixedCamera, Gate, Progress, Region, Scan, Shot
from .sift import SiftFeatures, SiftMatches, detect_sift, match_sift
from .simulator import HEAD_CAMERA, Frame, Motion, Simulator

__version__ = version()

__all__ = [
    "Adjusted",
    "Adjustment",
    "AngleMap",
    "AngleSummary",
    "BoardCalibration",
    "BoardView",
    "Boards",
    "Calibration",
    "Camera",
    "Cancel",
    "Cancelled",
    "Chessboard",
    "ChessboardAmbiguous",
    "ChessboardNotFound",
    "CommonLine",
    "Correspondences",
    "DepthMap",
    "DistortionModel",
    "Error",
    "Figure",
    "FixedCamera",
    "Focus",
    "Frame",
    "Gate",
    "HEAD_CAMERA",
    "Head",
    "HeadCapabilities",
    "HeadIdentity",
    "InvalidArgument",
    "LaserCalibration",
    "LaserColour",
    "LineFit",
    "LineMatches",
    "LineSegments",
    "LogLevel",
    "Motion",
    "MoveEnd",
    "MoveEvent",
    "PanTilt",
    "PanTiltZoom",
    "Picture",
    "PixelFormat",
    "Plane",
    "Planes",
    "PlanesNotFound",
    "Pose",
    "PoseMethod",
    "ProbeFigure",
    "ProbeReport",
    "Progress",
    "Region",
    "Rgbd",
    "RgbdLinePairs",
    "RgbdPairs",
    "RgbdView",
    "Rig",
    "RigCalibrated",
    "RigCalibration",
    "RigModel",
    "RigParameter",
    "RigView",
    "RoofEdges",
    "Scan",
    "Settle",
    "Shot",
    "SiftFeatures",
    "SiftMatches",
    "Simulator",
    "Spot",
    "SpotAmbiguous",
    "SpotNotFound",
    "SpotOptions",
    "StationPose",
    "StationsAmbiguous",
    "StationsNotMatched",
    "Status",
    "SureAngles",
    "Suspect",
    "UncertainRig",
    "ZoomCurve",
    "ZoomPosition",
    "abi_version",
    "calibrate_camera",
    "calibrate_from_boards",
    "calibrate_laser_line",
    "common_roof_edges",
    "detect_chessboard",
    "detect_edges",
    "detect_line_segments",
    "detect_sift",
    "detect_spot",
    "division_eigenproblem",
    "estimate_pose_roof_edges",
    "fit_line_3d",
    "learn_angles",
    "lift_line_segments",
    "match_lines",
    "match_sift",
    "probe",
    "radial_alignment",
    "read_image",
    "register_matched_planes",
    "register_stations",
    "version",
]
