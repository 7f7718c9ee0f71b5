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
from .cloud import Cloud, CloudNoise, Mesh
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
from .health import Health, ShotState, Verdict, check_health, choose_health_shots, fire_again
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
from .pointing import Aim, Located, MeasuredBy, Pointing, Sweep, ellipse
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
from .study import (
    LabelRow,
    Plan,
    PlannedShots,
    PrecisionLabel,
    SetUp,
    Site,
    Study,
    StudyCell,
    StudyDraws,
    StudyMethod,
    StudyPlot,
    StudyQuantity,
)

__version__ = version()

__all__ = [
    "Adjusted",
    "Adjustment",
    "Aim",
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
    "Cloud",
    "CloudNoise",
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
    "Health",
    "InvalidArgument",
    "LabelRow",
    "LaserCalibration",
    "LaserColour",
    "LineFit",
    "LineMatches",
    "LineSegments",
    "Located",
    "LogLevel",
    "Mesh",
    "MeasuredBy",
    "Motion",
    "MoveEnd",
    "MoveEvent",
    "PanTilt",
    "PanTiltZoom",
    "Picture",
    "PixelFormat",
    "Plan",
    "PlannedShots",
    "Pointing",
    "Pose",
    "PoseMethod",
    "PrecisionLabel",
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
    "SetUp",
    "Settle",
    "Shot",
    "ShotState",
    "SiftFeatures",
    "SiftMatches",
    "Simulator",
    "Site",
    "Spot",
    "SpotAmbiguous",
    "SpotNotFound",
    "SpotOptions",
    "Status",
    "Study",
    "StudyCell",
    "StudyDraws",
    "StudyMethod",
    "StudyPlot",
    "StudyQuantity",
    "SureAngles",
    "Suspect",
    "Sweep",
    "UncertainRig",
    "Verdict",
    "ZoomCurve",
    "ZoomPosition",
    "abi_version",
    "calibrate_camera",
    "calibrate_from_boards",
    "calibrate_laser_line",
    "check_health",
    "choose_health_shots",
    "detect_chessboard",
    "detect_edges",
    "detect_line_segments",
    "detect_sift",
    "detect_spot",
    "division_eigenproblem",
    "ellipse",
    "estimate_pose_roof_edges",
    "fire_again",
    "fit_line_3d",
    "learn_angles",
    "lift_line_segments",
    "match_lines",
    "match_sift",
    "probe",
    "radial_alignment",
    "read_image",
    "version",
]
