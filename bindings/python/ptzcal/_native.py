"""The C API as ctypes sees it: include/ptzcal.h is the manual.

tests/test_native.py compares every struct and every prototype here with that header.
"""

from __future__ import annotations

import ctypes
import os
from ctypes import (
    POINTER,
    Structure,
    byref,
    c_char_p,
    c_double,
    c_int32,
    c_int64,
    c_size_t,
    c_ssize_t,
    c_uint32,
    c_uint64,
    c_void_p,
    sizeof,
)
from typing import Any, Dict, Optional, Type, TypeVar, Union

from . import _library
from ._structs import (
    ptzcal_adjust_options,
    ptzcal_adjusted_summary,
    ptzcal_aim,
    ptzcal_angle_learning_options,
    ptzcal_angle_summary,
    ptzcal_board_view,
    ptzcal_calibration_summary,
    ptzcal_camera,
    ptzcal_chessboard,
    ptzcal_chessboard_options,
    ptzcal_clock_now_fn,
    ptzcal_clock_sleep_fn,
    ptzcal_common_line,
    ptzcal_explore_options,
    ptzcal_figure,
    ptzcal_frame_fn,
    ptzcal_head_capabilities,
    ptzcal_health,
    ptzcal_health_options,
    ptzcal_image,
    ptzcal_label_row,
    ptzcal_laser_fn,
    ptzcal_laser_line,
    ptzcal_line_fit_options,
    ptzcal_line_match_options,
    ptzcal_line_options,
    ptzcal_link,
    ptzcal_located,
    ptzcal_log_fn,
    ptzcal_loop,
    ptzcal_move_end_fn,
    ptzcal_plan_options,
    ptzcal_plan_summary,
    ptzcal_plane,
    ptzcal_planes_options,
    ptzcal_pose,
    ptzcal_probe_options,
    ptzcal_progress_fn,
    ptzcal_ptz,
    ptzcal_region,
    ptzcal_rgbd_options,
    ptzcal_rgbd_view,
    ptzcal_rig_model,
    ptzcal_rig_view,
    ptzcal_scan_summary,
    ptzcal_shot,
    ptzcal_sift_match_options,
    ptzcal_sift_options,
    ptzcal_spot,
    ptzcal_station_options,
    ptzcal_station_pose,
    ptzcal_study_cell,
    ptzcal_study_options,
    ptzcal_surface_options,
    ptzcal_suspect,
    ptzcal_sweep_summary,
    ptzcal_tie_options,
    ptzcal_ties_summary,
    ptzcal_visible,
    ptzcal_zoom_position,
)
from .errors import Error, error as _error

Path = Union[str, bytes, "os.PathLike[Any]"]

HEAD_CAMERA = 4294967295
"""The number of the head camera where a camera is asked for."""

NO_CAMERA = 4294967294
NO_PLANE = 4294967295

LABEL_HANDOFF = 4


# What parameters are. Arrays come as addresses, structs and places for results by byref().
_status = c_int32
_handle = c_void_p
_handle_out = POINTER(c_void_p)
_array = c_void_p
_user = c_void_p
_double_out = POINTER(c_double)
_int32_out = POINTER(c_int32)
_uint32_out = POINTER(c_uint32)
_size_out = POINTER(c_size_t)
_uint64_out = POINTER(c_uint64)
_images = POINTER(POINTER(ptzcal_image))
_board_view = POINTER(ptzcal_board_view)
_angle_learning_options = POINTER(ptzcal_angle_learning_options)
_angle_summary = POINTER(ptzcal_angle_summary)
_figure = POINTER(ptzcal_figure)
_probe_options = POINTER(ptzcal_probe_options)
_camera = POINTER(ptzcal_camera)
_capabilities = POINTER(ptzcal_head_capabilities)
_chessboard = POINTER(ptzcal_chessboard)
_chessboard_options = POINTER(ptzcal_chessboard_options)
_image = POINTER(ptzcal_image)
_laser_line = POINTER(ptzcal_laser_line)
_line_fit_options = POINTER(ptzcal_line_fit_options)
_line_match_options = POINTER(ptzcal_line_match_options)
_line_options = POINTER(ptzcal_line_options)
_model = POINTER(ptzcal_rig_model)
_pose = POINTER(ptzcal_pose)
_plane = POINTER(ptzcal_plane)
_planes_options = POINTER(ptzcal_planes_options)
_region = POINTER(ptzcal_region)
_station_options = POINTER(ptzcal_station_options)
_station_pose = POINTER(ptzcal_station_pose)
_link = POINTER(ptzcal_link)
_loop = POINTER(ptzcal_loop)
_tie_options = POINTER(ptzcal_tie_options)
_ties_summary = POINTER(ptzcal_ties_summary)
_rgbd_options = POINTER(ptzcal_rgbd_options)
_rgbd_view = POINTER(ptzcal_rgbd_view)
_scan_summary = POINTER(ptzcal_scan_summary)
_shot = POINTER(ptzcal_shot)
_sift_match_options = POINTER(ptzcal_sift_match_options)
_sift_options = POINTER(ptzcal_sift_options)
_spot = POINTER(ptzcal_spot)
_summary = POINTER(ptzcal_calibration_summary)
_study_options = POINTER(ptzcal_study_options)
_study_cell = POINTER(ptzcal_study_cell)
_label_row = POINTER(ptzcal_label_row)
_plan_options = POINTER(ptzcal_plan_options)
_plan_summary = POINTER(ptzcal_plan_summary)
_surface_options = POINTER(ptzcal_surface_options)
_adjust_options = POINTER(ptzcal_adjust_options)
_adjusted_summary = POINTER(ptzcal_adjusted_summary)
_suspect = POINTER(ptzcal_suspect)
_ptz = POINTER(ptzcal_ptz)
_common_line = POINTER(ptzcal_common_line)
_rig_view = POINTER(ptzcal_rig_view)
_zoom_position = POINTER(ptzcal_zoom_position)
_aim = POINTER(ptzcal_aim)
_explore_options = POINTER(ptzcal_explore_options)
_health = POINTER(ptzcal_health)
_health_options = POINTER(ptzcal_health_options)
_located = POINTER(ptzcal_located)
_sweep_summary = POINTER(ptzcal_sweep_summary)
_visible = POINTER(ptzcal_visible)
_error_out = POINTER(c_void_p)

# fmt: off
#: Name: result, then parameters.
PROTOTYPES: Dict[str, tuple] = {
    "ptzcal_version": (c_char_p,),
    "ptzcal_abi_version": (c_uint32,),
    "ptzcal_status_name": (c_char_p, c_int32),
    "ptzcal_error_status": (_status, _handle),
    "ptzcal_error_message": (c_char_p, _handle),
    "ptzcal_error_hint": (c_char_p, _handle),
    "ptzcal_error_index": (c_int64, _handle),
    "ptzcal_error_free": (None, _handle),
    "ptzcal_cancel_new": (_status, _handle_out, _error_out),
    "ptzcal_cancel_request": (_status, _handle),
    "ptzcal_cancel_reset": (_status, _handle),
    "ptzcal_cancel_is_requested": (c_int32, _handle),
    "ptzcal_cancel_free": (None, _handle),
    "ptzcal_image_init": (_status, _image, c_size_t),
    "ptzcal_picture_read": (_status, c_char_p, _handle_out, _error_out),
    "ptzcal_picture_new": (_status, _image, _handle_out, _error_out),
    "ptzcal_picture_beside": (_status, _image, _image, _handle_out, _error_out),
    "ptzcal_picture_free": (None, _handle),
    "ptzcal_picture_image": (_status, _handle, _image, _error_out),
    "ptzcal_picture_save": (_status, _handle, c_char_p, _error_out),
    "ptzcal_picture_dim": (_status, _handle, c_double, _error_out),
    "ptzcal_picture_draw_lines": (_status, _handle, _array, c_size_t, c_double, c_uint32, _error_out),
    "ptzcal_picture_draw_circles": (
        _status, _handle, _array, c_size_t, c_double, c_double, c_uint32, _error_out,
    ),
    "ptzcal_picture_draw_board": (_status, _handle, _array, _array, c_size_t, c_size_t, _error_out),
    "ptzcal_picture_draw_residuals": (
        _status, _handle, _array, _array, _array, c_size_t, c_double, _error_out,
    ),
    "ptzcal_picture_draw_matches": (
        _status, _handle, _array, _array, _array, c_size_t, c_double, _error_out,
    ),
    "ptzcal_depth_map_new_u16": (
        _status, _array, c_uint32, c_uint32, c_size_t, c_double, _handle_out, _error_out,
    ),
    "ptzcal_depth_map_new_f32": (
        _status, _array, c_uint32, c_uint32, c_size_t, c_double, _handle_out, _error_out,
    ),
    "ptzcal_depth_map_read": (_status, c_char_p, c_double, _handle_out, _error_out),
    "ptzcal_depth_map_free": (None, _handle),
    "ptzcal_depth_map_size": (_status, _handle, _uint32_out, _uint32_out, _size_out, _error_out),
    "ptzcal_depth_map_copy_metres": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    "ptzcal_depth_map_copy_variances": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    "ptzcal_depth_map_save": (_status, _handle, c_char_p, c_double, _error_out),
    "ptzcal_rgbd_options_init": (_status, _rgbd_options, c_size_t),
    "ptzcal_rgbd_view_init": (_status, _rgbd_view, c_size_t),
    "ptzcal_rgbd_new": (_status, _image, _rgbd_options, _handle_out, _error_out),
    "ptzcal_rgbd_free": (None, _handle),
    "ptzcal_rgbd_add_view": (_status, _handle, _image, _handle, _camera, _rgbd_view, _error_out),
    "ptzcal_rgbd_calibrate": (_status, _handle, _handle, _handle_out, _error_out),
    "ptzcal_rgbd_copy_pairs": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    "ptzcal_rgbd_copy_lines": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    # Cameras and rig models.
    "ptzcal_camera_init": (_status, _camera, c_size_t),
    "ptzcal_camera_centre": (_status, _camera, _array, _error_out),
    "ptzcal_camera_project": (_status, _camera, _array, c_size_t, _array, _error_out),
    "ptzcal_camera_back_project": (_status, _camera, _array, c_size_t, _array, _error_out),
    "ptzcal_camera_undistorted": (_status, _camera, c_double, _camera, _error_out),
    "ptzcal_undistorter_new": (_status, _camera, _camera, _handle_out, _error_out),
    "ptzcal_undistorter_free": (None, _handle),
    "ptzcal_undistorter_get_camera": (_status, _handle, _camera, _error_out),
    "ptzcal_undistorter_apply": (
        _status, _handle, _image, _array, c_size_t, c_ssize_t, _error_out,
    ),
    "ptzcal_undistorter_apply_region": (
        _status, _handle, _image, c_uint32, c_uint32, c_uint32, c_uint32, _array, _array, c_size_t,
        c_ssize_t, _error_out,
    ),
    "ptzcal_rig_model_init": (_status, _model, c_size_t),
    "ptzcal_rig_model_head_camera": (_status, _model, c_double, c_double, _camera, _error_out),
    "ptzcal_rig_model_locate": (
        _status, _model, _array, _array, _array, c_size_t, _array, _array, _error_out,
    ),
    "ptzcal_rig_model_aim": (_status, _model, _array, _double_out, _double_out, _error_out),
    # Detecting the laser's spot.
    "ptzcal_spot_init": (_status, _spot, c_size_t),
    "ptzcal_spot_options_new": (_status, _handle_out, _error_out),
    "ptzcal_spot_options_free": (None, _handle),
    "ptzcal_spot_options_set_region": (
        _status, _handle, c_uint32, c_uint32, c_uint32, c_uint32, _error_out,
    ),
    "ptzcal_spot_options_set_band": (_status, _handle, _array, c_size_t, c_double, _error_out),
    "ptzcal_spot_options_set_colour": (_status, _handle, c_uint32, _error_out),
    "ptzcal_spot_options_set_min_signal_to_noise": (_status, _handle, c_double, _error_out),
    "ptzcal_spot_options_set_max_area": (_status, _handle, c_uint32, _error_out),
    "ptzcal_spot_options_set_ambiguity_ratio": (_status, _handle, c_double, _error_out),
    "ptzcal_detect_spot": (_status, _image, _image, _handle, _spot, _error_out),
    "ptzcal_detect_spot_averaged": (
        _status, _images, c_size_t, _images, c_size_t, _handle, _spot, _error_out,
    ),
    "ptzcal_spot_detector_new": (_status, _handle, _handle_out, _error_out),
    "ptzcal_spot_detector_free": (None, _handle),
    "ptzcal_spot_detector_detect": (
        _status, _handle, _images, c_size_t, _images, c_size_t, _spot, _error_out,
    ),
    # Detecting chessboards.
    "ptzcal_chessboard_options_init": (_status, _chessboard_options, c_size_t),
    "ptzcal_chessboard_init": (_status, _chessboard, c_size_t),
    "ptzcal_detect_chessboard": (
        _status, _image, _chessboard_options, _chessboard, _array, _array, _array, c_size_t, _size_out, _error_out,
    ),
    # SIFT features.
    "ptzcal_sift_options_init": (_status, _sift_options, c_size_t),
    "ptzcal_detect_sift": (_status, _image, _sift_options, _handle_out, _error_out),
    "ptzcal_sift_features_new": (_status, _array, _array, c_size_t, _handle_out, _error_out),
    "ptzcal_sift_features_free": (None, _handle),
    "ptzcal_sift_features_count": (_status, _handle, _size_out, _error_out),
    "ptzcal_sift_features_copy_keypoints": (
        _status, _handle, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_sift_features_copy_descriptors": (
        _status, _handle, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_sift_match_options_init": (_status, _sift_match_options, c_size_t),
    "ptzcal_match_sift": (
        _status, _handle, _handle, _sift_match_options, _array, _array, c_size_t, _size_out, _error_out,
    ),
    # Edges and lines.
    "ptzcal_line_options_init": (_status, _line_options, c_size_t),
    "ptzcal_detect_edges": (
        _status, _image, c_double, c_double, c_double, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_detect_line_segments": (
        _status, _image, _line_options, _array, _array, _array, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_line_fit_options_init": (_status, _line_fit_options, c_size_t),
    "ptzcal_fit_line_3d": (
        _status, _array, _array, c_size_t, _line_fit_options, _array, _array, _array, _array, _double_out,
        _error_out,
    ),
    "ptzcal_lift_line_segments": (
        _status, _array, _array, _array, c_size_t, _camera, _handle, c_double, c_double, _array, _array,
        _array, _array, _error_out,
    ),
    "ptzcal_line_match_options_init": (_status, _line_match_options, c_size_t),
    "ptzcal_match_lines": (
        _status, _array, _array, _array, c_size_t, _camera, _array, _array, _array, c_size_t,
        _line_match_options, _array, _array, c_size_t, _size_out, _error_out,
    ),
    # Calibrating a camera.
    "ptzcal_correspondences_new": (_status, c_uint32, c_uint32, _handle_out, _error_out),
    "ptzcal_correspondences_free": (None, _handle),
    "ptzcal_correspondences_add_points": (_status, _handle, _array, _array, c_size_t, _error_out),
    "ptzcal_correspondences_add_points_weighted": (
        _status, _handle, _array, _array, _array, _array, c_size_t, _error_out,
    ),
    "ptzcal_correspondences_add_laser_shots": (
        _status, _handle, _model, _array, _array, _array, _array, _array, c_size_t, _error_out,
    ),
    "ptzcal_correspondences_add_lines": (
        _status, _handle, _array, _array, _array, _array, c_size_t, _error_out,
    ),
    "ptzcal_correspondences_add_directed_lines": (
        _status, _handle, _array, _array, _array, _array, c_size_t, _error_out,
    ),
    "ptzcal_correspondences_count": (_status, _handle, _size_out, _error_out),
    "ptzcal_calibration_options_new": (_status, _handle_out, _error_out),
    "ptzcal_calibration_options_free": (None, _handle),
    "ptzcal_calibration_options_set_distortion": (_status, _handle, c_uint32, _error_out),
    "ptzcal_calibration_options_set_lens": (_status, _handle, _camera, _error_out),
    "ptzcal_calibration_options_set_skew_sigma": (_status, _handle, c_double, _error_out),
    "ptzcal_calibration_options_set_aspect_sigma": (_status, _handle, c_double, _error_out),
    "ptzcal_calibration_options_set_pixel_sigma": (_status, _handle, c_double, _error_out),
    "ptzcal_calibration_options_set_robust": (_status, _handle, c_int32, _error_out),
    "ptzcal_calibration_options_set_seed": (_status, _handle, c_uint64, _error_out),
    "ptzcal_calibration_options_set_max_focal_deviation": (_status, _handle, c_double, _error_out),
    "ptzcal_calibration_options_set_max_iterations": (_status, _handle, c_uint32, _error_out),
    "ptzcal_calibration_options_set_cancel": (_status, _handle, _handle, _error_out),
    "ptzcal_calibrate_camera": (_status, _handle, _handle, _handle_out, _error_out),
    "ptzcal_radial_alignment": (_status, _handle, _array, _camera, _error_out),
    "ptzcal_division_eigenproblem": (_status, _handle, _array, _camera, _error_out),
    "ptzcal_calibration_free": (None, _handle),
    "ptzcal_calibration_get_camera": (_status, _handle, _camera, _error_out),
    "ptzcal_calibration_summary_init": (_status, _summary, c_size_t),
    "ptzcal_calibration_get_summary": (_status, _handle, _summary, _error_out),
    "ptzcal_calibration_copy_covariance": (
        _status, _handle, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_calibration_copy_residuals": (
        _status, _handle, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_calibration_copy_inliers": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    # Boards.
    "ptzcal_boards_new": (_status, c_uint32, c_uint32, _handle_out, _error_out),
    "ptzcal_boards_free": (None, _handle),
    "ptzcal_boards_add_view": (_status, _handle, _array, _array, _array, c_size_t, _error_out),
    "ptzcal_boards_set_spot": (_status, _handle, c_uint32, _array, _array, _error_out),
    "ptzcal_boards_set_bending": (_status, _handle, c_double, _error_out),
    "ptzcal_boards_count": (_status, _handle, _size_out, _error_out),
    "ptzcal_calibrate_from_boards": (_status, _handle, _handle, _handle_out, _error_out),
    "ptzcal_board_calibration_free": (None, _handle),
    "ptzcal_board_calibration_copy_camera": (_status, _handle, _handle_out, _error_out),
    "ptzcal_board_calibration_count": (_status, _handle, _size_out, _error_out),
    "ptzcal_board_view_init": (_status, _board_view, c_size_t),
    "ptzcal_board_calibration_get_view": (_status, _handle, c_uint32, _board_view, _error_out),
    "ptzcal_board_calibration_get_bending": (_status, _handle, _array, _error_out),
    "ptzcal_board_calibration_advice": (c_char_p, _handle),
    "ptzcal_calibration_warning": (c_char_p, _handle, c_size_t),
    "ptzcal_calibration_weakest": (c_char_p, _handle),
    "ptzcal_calibrate_laser_line": (
        _status, _handle, _handle, _handle, _handle_out, _error_out,
    ),
    "ptzcal_laser_calibration_free": (None, _handle),
    "ptzcal_laser_line_init": (_status, _laser_line, c_size_t),
    "ptzcal_laser_calibration_get_line": (_status, _handle, _laser_line, _error_out),
    "ptzcal_laser_calibration_get_rig_model": (_status, _handle, _model, _error_out),
    "ptzcal_laser_calibration_copy_boards": (_status, _handle, _handle_out, _error_out),
    "ptzcal_laser_calibration_copy_residuals": (
        _status, _handle, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_laser_calibration_copy_inliers": (
        _status, _handle, _array, c_size_t, _size_out, _error_out,
    ),
    # Rigs from pictures, and over zoom.
    "ptzcal_common_line_init": (_status, _common_line, c_size_t),
    "ptzcal_rig_calibrated_copy_boards": (_status, _handle, c_uint32, _handle_out, _error_out),
    "ptzcal_rig_calibrated_copy_corners": (
        _status, _handle, c_uint32, _array, _array,
        _array, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_rig_calibrated_copy_laser": (_status, _handle, c_uint32, _handle_out, _error_out),
    "ptzcal_rig_calibrated_count": (_status, _handle, _uint32_out, _uint32_out, _error_out),
    "ptzcal_rig_calibrated_free": (None, _handle),
    "ptzcal_rig_calibrated_get_common_line": (_status, _handle, _common_line, _error_out),
    "ptzcal_rig_calibrated_get_curve": (_status, _handle, _handle_out, _error_out),
    "ptzcal_rig_calibrated_get_position": (_status, _handle, c_uint32, _zoom_position, _error_out),
    "ptzcal_rig_calibrated_get_rig_model": (_status, _handle, c_uint32, _model, _array, _error_out),
    "ptzcal_rig_calibrated_get_view": (_status, _handle, c_uint32, _rig_view, _error_out),
    "ptzcal_rig_calibrated_laser_reason": (c_char_p, _handle, c_uint32),
    "ptzcal_rig_calibrated_position_reason": (c_char_p, _handle, c_uint32),
    "ptzcal_rig_calibrated_spot_reason": (c_char_p, _handle, c_uint32),
    "ptzcal_rig_calibrated_view_reason": (c_char_p, _handle, c_uint32),
    "ptzcal_rig_calibration_add_corners": (
        _status, _handle, c_double, c_uint32, c_uint32,
        _array, _array, _array, c_size_t, _uint32_out, _error_out,
    ),
    "ptzcal_rig_calibration_add_images": (
        _status, _handle, c_double, _image, _image, _uint32_out, _error_out,
    ),
    "ptzcal_rig_calibration_free": (None, _handle),
    "ptzcal_rig_calibration_new": (
        _status, c_uint32, c_uint32, c_double, _handle, _handle, _handle_out, _error_out,
    ),
    "ptzcal_rig_calibration_set_board": (
        _status, _handle, c_uint32, c_uint32, c_double, _error_out,
    ),
    "ptzcal_rig_calibration_set_common_line": (_status, _handle, c_int32, c_double, _error_out),
    "ptzcal_rig_calibration_set_spot": (_status, _handle, c_uint32, _array, _array, _error_out),
    "ptzcal_rig_calibration_solve": (_status, _handle, _handle_out, _error_out),
    "ptzcal_rig_view_init": (_status, _rig_view, c_size_t),
    "ptzcal_zoom_curve_free": (None, _handle),
    "ptzcal_zoom_curve_get_range": (_status, _handle, _double_out, _double_out, _error_out),
    "ptzcal_zoom_curve_get_rig_model": (_status, _handle, c_double, _model, _array, _error_out),
    "ptzcal_zoom_curve_load": (_status, c_char_p, _handle_out, _error_out),
    "ptzcal_zoom_curve_save": (_status, _handle, c_char_p, _error_out),
    "ptzcal_zoom_position_init": (_status, _zoom_position, c_size_t),
    # What a calibration's covariance means.
    "ptzcal_calibration_project": (
        _status, _handle, _array, _array, c_size_t, _array, _array, _error_out,
    ),
    "ptzcal_calibration_back_project": (
        _status, _handle, _array, _array, c_size_t, _array, _array, _error_out,
    ),
    "ptzcal_calibration_back_project_to_plane": (
        _status, _handle, _array, _array, c_size_t, _array, c_double, _array, _array, _error_out,
    ),
    # Rig poses by roof edges.
    "ptzcal_roof_edges_new": (_status, _handle_out, _error_out),
    "ptzcal_roof_edges_free": (None, _handle),
    "ptzcal_roof_edges_add_plane_shots": (
        _status, _handle, _model, _array, _array, _array, c_size_t, _uint32_out, _error_out,
    ),
    "ptzcal_roof_edges_add_plane_points": (
        _status, _handle, _array, c_size_t, c_double, _uint32_out, _error_out,
    ),
    "ptzcal_roof_edges_add_plane": (
        _status, _handle, _array, c_double, _array, _uint32_out, _error_out,
    ),
    "ptzcal_roof_edges_add_edge": (_status, _handle, c_uint32, c_uint32, _error_out),
    "ptzcal_pose_options_new": (_status, _handle_out, _error_out),
    "ptzcal_pose_options_free": (None, _handle),
    "ptzcal_pose_options_set_method": (_status, _handle, c_uint32, _error_out),
    "ptzcal_pose_options_set_lever": (_status, _handle, c_double, _error_out),
    "ptzcal_pose_options_set_min_angles": (_status, _handle, c_double, c_double, _error_out),
    "ptzcal_estimate_pose_roof_edges": (
        _status, _handle, _handle, _handle, _handle_out, _error_out,
    ),
    "ptzcal_pose_estimate_free": (None, _handle),
    "ptzcal_pose_init": (_status, _pose, c_size_t),
    "ptzcal_pose_estimate_get": (_status, _handle, _pose, _error_out),
    "ptzcal_pose_estimate_copy_covariance": (
        _status, _handle, _array, c_size_t, _size_out, _error_out,
    ),
    # Planes of scans, poses between stations by planes.
    "ptzcal_planes_options_init": (_status, _planes_options, c_size_t),
    "ptzcal_planes_find_points": (
        _status, _array, c_size_t, c_double, _planes_options, _handle_out, _error_out,
    ),
    "ptzcal_planes_find_ranges": (
        _status, _array, c_size_t, c_double, _planes_options, _handle_out, _error_out,
    ),
    "ptzcal_planes_find_shots": (
        _status, _model, _array, _array, _array, c_size_t, _planes_options, _handle_out, _error_out,
    ),
    "ptzcal_planes_find_depths": (
        _status, _handle, _camera, c_double, c_double, _planes_options, _handle_out, _error_out,
    ),
    "ptzcal_planes_fit_points": (
        _status, _array, c_size_t, c_double, _array, c_uint32, _planes_options, _handle_out,
        _error_out,
    ),
    "ptzcal_planes_fit_shots": (
        _status, _model, _array, _array, _array, c_size_t, _array, c_uint32, _planes_options,
        _handle_out, _error_out,
    ),
    "ptzcal_planes_fit_points_in_boxes": (
        _status, _array, c_size_t, c_double, _array, c_uint32, _planes_options, _handle_out,
        _error_out,
    ),
    "ptzcal_planes_fit_shots_in_boxes": (
        _status, _model, _array, _array, _array, c_size_t, _array, c_uint32, _planes_options,
        _handle_out, _error_out,
    ),
    "ptzcal_planes_find_scan": (_status, _handle, _planes_options, _handle_out, _error_out),
    "ptzcal_planes_fit_scan": (
        _status, _handle, _array, c_uint32, _planes_options, _handle_out, _error_out,
    ),
    "ptzcal_planes_fit_scan_in_boxes": (
        _status, _handle, _array, c_uint32, _planes_options, _handle_out, _error_out,
    ),
    "ptzcal_planes_free": (None, _handle),
    "ptzcal_planes_count": (_status, _handle, _uint32_out, _error_out),
    "ptzcal_plane_init": (_status, _plane, c_size_t),
    "ptzcal_planes_get": (_status, _handle, c_uint32, _plane, _error_out),
    "ptzcal_planes_copy_labels": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    "ptzcal_planes_sigma": (_status, _handle, _double_out, _error_out),
    "ptzcal_station_options_init": (_status, _station_options, c_size_t),
    "ptzcal_register_stations": (
        _status, _handle, _handle, _station_options, _handle_out, _error_out,
    ),
    "ptzcal_register_matched_planes": (
        _status, _handle, _handle, _array, c_size_t, _handle_out, _error_out,
    ),
    "ptzcal_registration_free": (None, _handle),
    "ptzcal_station_pose_init": (_status, _station_pose, c_size_t),
    "ptzcal_registration_get": (_status, _handle, _station_pose, _error_out),
    "ptzcal_registration_copy_matches": (
        _status, _handle, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_registration_roof_edges": (
        _status, _handle, _handle, _handle, c_double, _handle_out, _handle_out, _error_out,
    ),
    # Simulator.
    "ptzcal_ptz_init": (_status, _ptz, c_size_t),
    "ptzcal_simulator_new": (_status, c_char_p, _handle_out, _error_out),
    "ptzcal_simulator_free": (None, _handle),
    "ptzcal_simulator_nominal_rig": (_status, _handle, _model, _error_out),
    "ptzcal_simulator_true_rig": (_status, _handle, _model, _error_out),
    "ptzcal_simulator_fixed_cameras": (_status, _handle, _size_out, _error_out),
    "ptzcal_simulator_true_camera": (_status, _handle, c_uint32, _camera, _error_out),
    "ptzcal_simulator_true_station": (_status, _handle, _pose, _error_out),
    "ptzcal_simulator_move": (_status, _handle, c_double, c_double, _error_out),
    "ptzcal_simulator_position": (_status, _handle, _double_out, _double_out, _error_out),
    "ptzcal_simulator_motion": (_status, _handle, _int32_out, _error_out),
    "ptzcal_simulator_stop": (_status, _handle, _error_out),
    "ptzcal_simulator_set_laser": (_status, _handle, c_int32, _error_out),
    "ptzcal_simulator_next_frame": (
        _status, _handle, c_uint32, c_double, c_double, _image, _double_out, _error_out,
    ),
    "ptzcal_simulator_now": (_status, _handle, _double_out, _error_out),
    "ptzcal_simulator_sleep": (_status, _handle, c_double, _error_out),
    # Rigs.
    "ptzcal_rig_options_new": (_status, _handle_out, _error_out),
    "ptzcal_rig_options_free": (None, _handle),
    "ptzcal_rig_options_set_address": (_status, _handle, c_char_p, _error_out),
    "ptzcal_rig_options_set_ptz_address": (_status, _handle, c_char_p, _error_out),
    "ptzcal_rig_options_set_laser_address": (_status, _handle, c_char_p, _error_out),
    "ptzcal_rig_options_set_frames_address": (_status, _handle, c_char_p, _error_out),
    "ptzcal_rig_options_set_angle_map": (_status, _handle, _handle, _error_out),
    "ptzcal_rig_options_set_laser_duty": (_status, _handle, c_double, c_double, _error_out),
    "ptzcal_rig_options_set_credentials": (_status, _handle, c_char_p, c_char_p, _error_out),
    "ptzcal_rig_options_set_model": (_status, _handle, _model, _error_out),
    "ptzcal_rig_options_set_ptz": (_status, _handle, _ptz, _error_out),
    "ptzcal_rig_options_set_laser": (_status, _handle, ptzcal_laser_fn, _user, _error_out),
    "ptzcal_rig_options_set_frames": (_status, _handle, ptzcal_frame_fn, _user, _error_out),
    "ptzcal_rig_options_set_clock": (
        _status, _handle, ptzcal_clock_now_fn, ptzcal_clock_sleep_fn, _user, _error_out,
    ),
    "ptzcal_rig_options_set_log": (_status, _handle, ptzcal_log_fn, _user, _error_out),
    "ptzcal_rig_options_set_settle": (
        _status, _handle, c_uint32, c_double, c_double, c_double, c_double, _error_out,
    ),
    "ptzcal_rig_options_set_frame_wait": (_status, _handle, c_double, c_uint32, _error_out),
    "ptzcal_rig_options_set_laser_max_on": (_status, _handle, c_double, _error_out),
    "ptzcal_rig_open": (_status, _handle, _handle_out, _error_out),
    "ptzcal_rig_close": (_status, _handle, _error_out),
    "ptzcal_rig_get_model": (_status, _handle, _model, _error_out),
    "ptzcal_rig_simulator": (_status, _handle, _handle_out, _error_out),
    "ptzcal_rig_move": (_status, _handle, c_double, c_double, _handle, _error_out),
    "ptzcal_rig_position": (_status, _handle, _double_out, _double_out, _error_out),
    "ptzcal_rig_aim_at_point": (
        _status, _handle, _array, _handle, _double_out, _double_out, _error_out,
    ),
    "ptzcal_rig_aim_at_pixel": (
        _status, _handle, c_double, c_double, c_double, _handle, _double_out, _double_out,
        _error_out,
    ),
    "ptzcal_rig_set_laser": (_status, _handle, c_int32, _error_out),
    "ptzcal_rig_stop": (_status, _handle, _error_out),
    "ptzcal_rig_emergency_off": (_status, _handle, _error_out),
    "ptzcal_rig_release": (_status, _handle, _error_out),
    # Heads.
    "ptzcal_head_options_new": (_status, _handle_out, _error_out),
    "ptzcal_head_options_free": (None, _handle),
    "ptzcal_head_options_set_address": (_status, _handle, c_char_p, _error_out),
    "ptzcal_head_options_set_ptz": (_status, _handle, _ptz, _error_out),
    "ptzcal_head_options_set_frames_address": (_status, _handle, c_char_p, _error_out),
    "ptzcal_head_options_set_laser_address": (_status, _handle, c_char_p, _error_out),
    "ptzcal_head_options_set_frames": (_status, _handle, ptzcal_frame_fn, _user, _error_out),
    "ptzcal_head_options_set_laser": (_status, _handle, ptzcal_laser_fn, _user, _error_out),
    "ptzcal_head_options_set_angle_map": (_status, _handle, _handle, _error_out),
    "ptzcal_head_options_set_credentials": (_status, _handle, c_char_p, c_char_p, _error_out),
    "ptzcal_head_options_set_log": (_status, _handle, ptzcal_log_fn, _user, _error_out),
    "ptzcal_head_options_set_on_move_end": (
        _status, _handle, ptzcal_move_end_fn, _user, _error_out,
    ),
    "ptzcal_head_capabilities_init": (_status, _capabilities, c_size_t),
    "ptzcal_head_open": (_status, _handle, _handle_out, _error_out),
    "ptzcal_head_close": (_status, _handle, _error_out),
    "ptzcal_head_get_capabilities": (_status, _handle, _capabilities, _error_out),
    "ptzcal_head_copy_identity": (
        _status, _handle, c_uint32, c_char_p, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_head_position": (
        _status, _handle, _double_out, _double_out, _double_out, _error_out,
    ),
    "ptzcal_head_motion": (_status, _handle, _int32_out, _error_out),
    "ptzcal_head_move": (_status, _handle, c_double, c_double, _uint64_out, _error_out),
    "ptzcal_head_move_by": (_status, _handle, c_double, c_double, _uint64_out, _error_out),
    "ptzcal_head_move_in_view": (_status, _handle, c_double, c_double, _uint64_out, _error_out),
    "ptzcal_head_drive": (
        _status, _handle, c_double, c_double, c_double, c_double, _uint64_out, _error_out,
    ),
    "ptzcal_head_stop": (_status, _handle, _error_out),
    "ptzcal_head_home": (_status, _handle, _uint64_out, _error_out),
    "ptzcal_head_set_zoom": (_status, _handle, c_double, _uint64_out, _error_out),
    "ptzcal_head_set_focus": (_status, _handle, c_uint32, c_double, _error_out),
    "ptzcal_head_focus": (_status, _handle, _double_out, _error_out),
    "ptzcal_head_lock_exposure": (_status, _handle, c_uint32, _error_out),
    "ptzcal_head_store_preset": (_status, _handle, c_uint32, _error_out),
    "ptzcal_head_recall_preset": (_status, _handle, c_uint32, _uint64_out, _error_out),
    "ptzcal_head_clear_preset": (_status, _handle, c_uint32, _error_out),
    "ptzcal_head_wait": (
        _status, _handle, c_uint64, c_double, _handle, _int32_out, _int32_out, _error_out,
    ),
    # Angle maps and probing.
    "ptzcal_angle_summary_init": (_status, _angle_summary, c_size_t),
    "ptzcal_angle_map_read": (_status, c_char_p, _handle_out, _error_out),
    "ptzcal_angle_map_save": (_status, _handle, c_char_p, _error_out),
    "ptzcal_angle_map_free": (None, _handle),
    "ptzcal_angle_map_get_summary": (_status, _handle, _angle_summary, _error_out),
    "ptzcal_angle_map_to_angles": (
        _status, _handle, c_double, c_double, _double_out, _double_out, _double_out, _double_out,
        _error_out,
    ),
    "ptzcal_angle_map_to_raw": (
        _status, _handle, c_double, c_double, _double_out, _double_out, _error_out,
    ),
    "ptzcal_angle_learning_options_init": (_status, _angle_learning_options, c_size_t),
    "ptzcal_learn_angles": (
        _status, _handle, _camera, _angle_learning_options, ptzcal_progress_fn, _user, _handle,
        _handle_out, _error_out,
    ),
    "ptzcal_probe_options_init": (_status, _probe_options, c_size_t),
    "ptzcal_figure_init": (_status, _figure, c_size_t),
    "ptzcal_probe": (
        _status, _handle, _camera, _probe_options, _handle, _handle_out, _error_out,
    ),
    "ptzcal_probe_report_get": (_status, _handle, c_uint32, _figure, _error_out),
    "ptzcal_probe_report_copy_text": (
        _status, _handle, c_char_p, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_probe_report_free": (None, _handle),
    # Scanning a region.
    "ptzcal_shot_init": (_status, _shot, c_size_t),
    "ptzcal_region_init": (_status, _region, c_size_t),
    "ptzcal_rig_recorded_region": (_status, _handle, _region, _error_out),
    "ptzcal_scan_summary_init": (_status, _scan_summary, c_size_t),
    "ptzcal_scan_options_new": (_status, _handle_out, _error_out),
    "ptzcal_scan_options_free": (None, _handle),
    "ptzcal_scan_options_add_camera": (
        _status, _handle, ptzcal_frame_fn, _user, c_uint32, c_uint32, _uint32_out, _error_out,
    ),
    "ptzcal_scan_options_add_camera_address": (
        _status, _handle, c_char_p, _uint32_out, _error_out,
    ),
    "ptzcal_scan_options_set_known_camera": (_status, _handle, c_uint32, _camera, _error_out),
    "ptzcal_scan_options_set_distortion": (_status, _handle, c_uint32, c_uint32, _error_out),
    "ptzcal_scan_options_set_frames_per_state": (_status, _handle, c_uint32, _error_out),
    "ptzcal_scan_options_set_coarse_shots": (_status, _handle, c_uint32, _error_out),
    "ptzcal_scan_options_set_spot": (_status, _handle, _handle, _error_out),
    "ptzcal_scan_options_set_gate": (
        _status, _handle, c_double, c_double, c_double, c_double, _error_out,
    ),
    "ptzcal_scan_options_set_journal": (_status, _handle, c_char_p, c_int32, _error_out),
    "ptzcal_scan_options_set_reconnect": (_status, _handle, c_double, _error_out),
    "ptzcal_scan_options_set_target_accuracy": (_status, _handle, c_double, _error_out),
    "ptzcal_scan_options_set_recording": (_status, _handle, c_char_p, _error_out),
    "ptzcal_scan_options_set_cancel": (_status, _handle, _handle, _error_out),
    "ptzcal_rig_scan_region": (
        _status, _handle, _region, _handle, ptzcal_progress_fn, _user, _handle_out, _error_out,
    ),
    "ptzcal_scan_free": (None, _handle),
    "ptzcal_scan_get_summary": (_status, _handle, _scan_summary, _error_out),
    "ptzcal_scan_camera_size": (_status, _handle, c_uint32, _uint32_out, _uint32_out, _error_out),
    "ptzcal_scan_end": (_status, _handle, _error_out),
    "ptzcal_scan_get_shot": (_status, _handle, c_size_t, _shot, _error_out),
    "ptzcal_scan_get_spot": (_status, _handle, c_size_t, c_uint32, _spot, _error_out),
    "ptzcal_scan_copy_points": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    "ptzcal_correspondences_add_scan": (_status, _handle, _handle, c_uint32, _error_out),
    "ptzcal_roof_edges_add_plane_scan": (
        _status, _handle, _handle, _region, _uint32_out, _error_out,
    ),
    # Reports.
    "ptzcal_report_new": (_status, c_char_p, _handle_out, _error_out),
    "ptzcal_report_free": (None, _handle),
    "ptzcal_report_set_up": (_status, _handle, _array, _error_out),
    "ptzcal_report_add_note": (_status, _handle, c_char_p, _error_out),
    "ptzcal_report_add_calibration": (_status, _handle, c_char_p, _handle, _handle, _image, _error_out),
    "ptzcal_report_add_board_calibration": (_status, _handle, c_char_p, _handle, _handle, _error_out),
    "ptzcal_report_add_scan": (_status, _handle, c_char_p, _handle, _error_out),
    "ptzcal_report_add_adjusted": (_status, _handle, c_char_p, _handle, _error_out),
    "ptzcal_report_add_input": (_status, _handle, c_char_p, _array, c_size_t, _error_out),
    "ptzcal_report_copy_html": (_status, _handle, c_char_p, c_size_t, _size_out, _error_out),
    "ptzcal_report_save": (_status, _handle, c_char_p, _error_out),
    # Clouds and meshes.
    "ptzcal_cloud_new": (_status, _handle_out, _error_out),
    "ptzcal_cloud_from_scan": (_status, _handle, _handle_out, _error_out),
    "ptzcal_cloud_from_depth_map": (
        _status, _handle, _camera, _image, c_double, c_double, _handle_out, _error_out,
    ),
    "ptzcal_cloud_free": (None, _handle),
    "ptzcal_cloud_add_points": (_status, _handle, _array, _array, _array, c_size_t, _error_out),
    "ptzcal_cloud_merge": (_status, _handle, _handle, _error_out),
    "ptzcal_cloud_strip": (_status, _handle, _error_out),
    "ptzcal_cloud_transform": (_status, _handle, _pose, _array, _error_out),
    "ptzcal_cloud_crop": (_status, _handle, _array, _array, _error_out),
    "ptzcal_cloud_thin": (_status, _handle, c_double, _error_out),
    "ptzcal_cloud_size": (_status, _handle, _size_out, _uint32_out, _uint32_out, _error_out),
    "ptzcal_cloud_copy_points": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    "ptzcal_cloud_copy_colours": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    "ptzcal_cloud_copy_normals": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    "ptzcal_cloud_copy_deviations": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    "ptzcal_cloud_copy_covariances": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    "ptzcal_cloud_save": (_status, _handle, c_char_p, _error_out),
    "ptzcal_cloud_load": (_status, c_char_p, _handle_out, _size_out, _error_out),
    "ptzcal_cloud_depth_map": (_status, _handle, _camera, _handle_out, _error_out),
    "ptzcal_surface_options_init": (_status, _surface_options, c_size_t),
    "ptzcal_mesh_new": (_status, _handle, _array, c_size_t, _handle_out, _error_out),
    "ptzcal_mesh_from_scan": (_status, _handle, _surface_options, _handle_out, _error_out),
    "ptzcal_mesh_from_depth_map": (
        _status, _handle, _camera, _image, c_double, c_double, _surface_options, _handle_out,
        _error_out,
    ),
    "ptzcal_mesh_free": (None, _handle),
    "ptzcal_mesh_add_picture": (_status, _handle, _image, _camera, _error_out),
    "ptzcal_mesh_texture": (_status, _handle, _size_out, _error_out),
    "ptzcal_mesh_size": (_status, _handle, _size_out, _size_out, _size_out, _error_out),
    "ptzcal_mesh_vertices": (_status, _handle, _handle_out, _error_out),
    "ptzcal_mesh_copy_triangles": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    "ptzcal_mesh_save": (_status, _handle, c_char_p, _error_out),
    "ptzcal_mesh_load": (_status, c_char_p, _handle_out, _error_out),
    "ptzcal_mesh_depth_map": (_status, _handle, _camera, _handle_out, _error_out),
    # Exploring, health checks, pointing.
    "ptzcal_explore_options_init": (_status, _explore_options, c_size_t),
    "ptzcal_visible_init": (_status, _visible, c_size_t),
    "ptzcal_rig_explore": (
        _status, _handle, _explore_options, _handle, ptzcal_progress_fn, _user,
        _handle_out, _error_out,
    ),
    "ptzcal_exploration_free": (None, _handle),
    "ptzcal_exploration_get_visible": (_status, _handle, c_uint32, _region, _visible, _error_out),
    "ptzcal_exploration_copy_mask": (
        _status, _handle, c_uint32, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_exploration_get_scan": (_status, _handle, _handle_out, _error_out),
    "ptzcal_rig_fire_again": (
        _status, _handle, _handle, _array, c_size_t, _handle, ptzcal_progress_fn, _user,
        _handle_out, _error_out,
    ),
    "ptzcal_health_options_init": (_status, _health_options, c_size_t),
    "ptzcal_health_init": (_status, _health, c_size_t),
    "ptzcal_scan_choose_health_shots": (
        _status, _handle, c_uint32, c_size_t, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_health_check": (
        _status, _model, _handle, _handle, _handle, c_uint32, _health_options,
        _handle_out, _error_out,
    ),
    "ptzcal_health_check_spots": (
        _status, _model, _handle, _array, _array, _array, c_size_t, _health_options,
        _handle_out, _error_out,
    ),
    "ptzcal_health_report_free": (None, _handle),
    "ptzcal_health_report_get": (_status, _handle, _health, _error_out),
    "ptzcal_health_report_reason": (c_char_p, _handle),
    "ptzcal_health_report_copy_shots": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    "ptzcal_health_report_refitted": (_status, _handle, _handle_out, _error_out),
    "ptzcal_aim_init": (_status, _aim, c_size_t),
    "ptzcal_located_init": (_status, _located, c_size_t),
    "ptzcal_pointing_new": (_status, _handle, _model, _handle_out, _error_out),
    "ptzcal_pointing_new_adjusted": (_status, _handle, c_uint32, c_uint32, _handle_out, _error_out),
    "ptzcal_pointing_free": (None, _handle),
    "ptzcal_pointing_set_rig_covariance": (_status, _handle, _array, _error_out),
    "ptzcal_pointing_set_station": (_status, _handle, _pose, _array, _error_out),
    "ptzcal_pointing_set_head_deviation": (_status, _handle, c_double, c_double, _error_out),
    "ptzcal_pointing_set_zoom_curve": (_status, _handle, _handle, _error_out),
    "ptzcal_pointing_set_reach": (
        _status, _handle, c_double, c_double, c_double, c_double, _error_out,
    ),
    "ptzcal_pointing_set_plane": (_status, _handle, _array, c_double, _array, c_uint32, _error_out),
    "ptzcal_pointing_set_cloud": (_status, _handle, _array, _array, c_size_t, c_uint32, _error_out),
    "ptzcal_pointing_set_distance": (_status, _handle, c_double, c_double, _error_out),
    "ptzcal_pointing_aim": (_status, _handle, _array, _array, c_double, c_double, _aim, _error_out),
    "ptzcal_pointing_locate": (
        _status, _handle, c_double, c_double, c_double, _array, _array, _located,
        _error_out,
    ),
    "ptzcal_pointing_copy_located_along": (
        _status, _handle, c_double, c_double, c_double, _array, _array, c_double,
        c_double, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_ellipse": (_status, _array, c_double, _array, _array, _error_out),
    "ptzcal_sweep_summary_init": (_status, _sweep_summary, c_size_t),
    "ptzcal_pointing_sweep": (
        _status, _handle, _array, _array, c_double, c_double, c_double, c_double,
        _handle_out, _error_out,
    ),
    "ptzcal_sweep_free": (None, _handle),
    "ptzcal_sweep_get_summary": (_status, _handle, _sweep_summary, _error_out),
    "ptzcal_sweep_copy_steps": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    "ptzcal_sweep_copy_curve": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    # Joint adjustment.
    "ptzcal_adjustment_new": (_status, _model, _handle_out, _error_out),
    "ptzcal_adjustment_free": (None, _handle),
    "ptzcal_adjustment_set_rig_sigmas": (_status, _handle, _array, _error_out),
    "ptzcal_adjustment_set_rig_covariance": (_status, _handle, _array, _error_out),
    "ptzcal_adjustment_add_station": (_status, _handle, _pose, _array, _uint32_out, _error_out),
    "ptzcal_adjustment_add_camera": (
        _status, _handle, c_uint32, c_uint32, _handle, _uint32_out, _error_out,
    ),
    "ptzcal_adjustment_add_calibrated_camera": (
        _status, _handle, _handle, _uint32_out, _error_out,
    ),
    "ptzcal_adjustment_add_known_camera": (
        _status, _handle, _camera, _array, c_size_t, _uint32_out, _error_out,
    ),
    "ptzcal_adjustment_add_shots": (
        _status, _handle, c_uint32, _array, _array, _array, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_adjustment_add_sightings": (
        _status, _handle, c_uint32, _array, _array, _array, c_size_t, _error_out,
    ),
    "ptzcal_adjustment_add_scan": (
        _status, _handle, c_uint32, _handle, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_adjust_options_init": (_status, _adjust_options, c_size_t),
    "ptzcal_adjustment_solve": (
        _status, _handle, _adjust_options, _handle, _handle_out, _error_out,
    ),
    "ptzcal_adjusted_free": (None, _handle),
    "ptzcal_adjusted_summary_init": (_status, _adjusted_summary, c_size_t),
    "ptzcal_adjusted_get_summary": (_status, _handle, _adjusted_summary, _error_out),
    "ptzcal_adjusted_get_rig_model": (_status, _handle, _model, _error_out),
    "ptzcal_adjusted_get_station": (_status, _handle, c_uint32, _pose, _error_out),
    "ptzcal_adjusted_get_calibration": (_status, _handle, c_uint32, _handle_out, _error_out),
    "ptzcal_adjusted_copy_covariance": (
        _status, _handle, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_adjusted_parameter_name": (c_char_p, _handle, c_size_t),
    "ptzcal_adjusted_resolve": (_status, _handle, _handle, _handle_out, _error_out),
    "ptzcal_adjusted_warning": (c_char_p, _handle, c_size_t),
    "ptzcal_adjusted_weakest": (c_char_p, _handle),
    "ptzcal_adjusted_prior_only": (c_char_p, _handle, c_size_t),
    "ptzcal_suspect_init": (_status, _suspect, c_size_t),
    "ptzcal_adjusted_get_suspect": (_status, _handle, c_size_t, _suspect, _error_out),
    "ptzcal_adjusted_suspect_name": (c_char_p, _handle, c_size_t),
    "ptzcal_adjusted_copy_head_inliers": (
        _status, _handle, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_adjusted_shot_point": (_status, _handle, c_size_t, _array, _array, _error_out),
    "ptzcal_adjusted_measure": (
        _status, _handle, c_uint32, _array, _array, _array, c_size_t, _array, _array, _error_out,
    ),
    "ptzcal_adjustment_add_plane": (_status, _handle, c_double, _uint32_out, _error_out),
    "ptzcal_adjustment_set_planes": (_status, _handle, c_size_t, _array, c_size_t, _error_out),
    "ptzcal_adjusted_get_plane": (_status, _handle, c_uint32, _array, _array, _error_out),
    "ptzcal_adjusted_copy_plane_inliers": (
        _status, _handle, _array, c_size_t, _size_out, _error_out,
    ),
    # Stations along a path.
    "ptzcal_tie_options_init": (_status, _tie_options, c_size_t),
    "ptzcal_adjustment_tie_stations": (
        _status, _handle, _tie_options, ptzcal_progress_fn, _user, _handle, _handle_out, _error_out,
    ),
    "ptzcal_ties_free": (None, _handle),
    "ptzcal_ties_summary_init": (_status, _ties_summary, c_size_t),
    "ptzcal_ties_get_summary": (_status, _handle, _ties_summary, _error_out),
    "ptzcal_link_init": (_status, _link, c_size_t),
    "ptzcal_ties_get_link": (_status, _handle, c_uint32, _link, _error_out),
    "ptzcal_ties_link_reason": (c_char_p, _handle, c_uint32),
    "ptzcal_ties_get_registration": (_status, _handle, c_uint32, _handle_out, _error_out),
    "ptzcal_loop_init": (_status, _loop, c_size_t),
    "ptzcal_ties_get_loop": (_status, _handle, c_uint32, _loop, _error_out),
    "ptzcal_ties_copy_loop": (
        _status, _handle, c_uint32, _array, c_size_t, _size_out, _error_out,
    ),
    # Studies, labels, plans, next shots.
    "ptzcal_site_new": (_status, _model, _camera, _handle_out, _error_out),
    "ptzcal_site_free": (None, _handle),
    "ptzcal_site_set_rig_sigmas": (_status, _handle, _array, _error_out),
    "ptzcal_site_set_pointing_sigma": (_status, _handle, c_double, c_double, _error_out),
    "ptzcal_site_set_estimate": (_status, _handle, _handle, _error_out),
    "ptzcal_site_set_plane": (_status, _handle, _array, c_double, _error_out),
    "ptzcal_site_set_room": (_status, _handle, _array, _array, c_size_t, _error_out),
    "ptzcal_site_set_depths": (_status, _handle, c_double, c_double, _error_out),
    "ptzcal_set_up_from_region": (_status, _handle, _region, _handle_out, _error_out),
    "ptzcal_set_up_from_scan": (_status, _handle, _handle, _handle_out, _error_out),
    "ptzcal_set_up_from_points": (_status, _handle, _array, c_size_t, _handle_out, _error_out),
    "ptzcal_set_up_set_control": (_status, _handle, _array, c_size_t, _error_out),
    "ptzcal_set_up_get_count": (_status, _handle, _size_out, _error_out),
    "ptzcal_set_up_free": (None, _handle),
    "ptzcal_study_options_init": (_status, _study_options, c_size_t),
    "ptzcal_study_cell_init": (_status, _study_cell, c_size_t),
    "ptzcal_study_run": (
        _status, _handle, _array, c_size_t, _array, c_size_t, _study_options, ptzcal_progress_fn, _user,
        _handle, _handle_out, _error_out,
    ),
    "ptzcal_study_get_cell": (_status, _handle, c_uint32, c_size_t, _study_cell, _error_out),
    "ptzcal_study_copy_handoff": (
        _status, _handle, c_uint32, c_size_t, _array, c_size_t, _size_out, _error_out,
    ),
    "ptzcal_study_save_json": (_status, _handle, c_char_p, _error_out),
    "ptzcal_study_save_csv": (_status, _handle, c_char_p, _error_out),
    "ptzcal_study_save_plot": (_status, _handle, c_uint32, c_uint32, c_char_p, _error_out),
    "ptzcal_study_free": (None, _handle),
    "ptzcal_label_row_init": (_status, _label_row, c_size_t),
    "ptzcal_label_make": (
        _status, _handle, _array, c_size_t, _array, c_size_t, _study_options, ptzcal_progress_fn, _user,
        _handle, _handle_out, _error_out,
    ),
    "ptzcal_label_get_count": (_status, _handle, _size_out, _error_out),
    "ptzcal_label_get_row": (_status, _handle, c_size_t, _label_row, _error_out),
    "ptzcal_label_save_json": (_status, _handle, c_char_p, _error_out),
    "ptzcal_label_save_csv": (_status, _handle, c_char_p, _error_out),
    "ptzcal_label_save_plot": (_status, _handle, c_uint32, c_char_p, _error_out),
    "ptzcal_label_free": (None, _handle),
    "ptzcal_plan_options_init": (_status, _plan_options, c_size_t),
    "ptzcal_plan_summary_init": (_status, _plan_summary, c_size_t),
    "ptzcal_plan_make": (_status, _handle, _plan_options, _handle, _handle_out, _error_out),
    "ptzcal_plan_get_summary": (_status, _handle, _plan_summary, _error_out),
    "ptzcal_plan_copy_shots": (_status, _handle, _array, c_size_t, _size_out, _error_out),
    "ptzcal_plan_free": (None, _handle),
    "ptzcal_next_shots": (
        _status, _handle, _array, c_size_t, _region, c_double, c_double, c_double, c_uint32, _array, _array,
        c_size_t, _size_out, _error_out,
    ),
    # Cameras in files of other programs.
    "ptzcal_camera_read": (_status, c_char_p, c_uint32, _camera, _error_out),
    "ptzcal_camera_write": (_status, _camera, c_char_p, c_uint32, _error_out),
    "ptzcal_camera_list_new": (_status, _handle_out, _error_out),
    "ptzcal_camera_list_free": (None, _handle),
    "ptzcal_camera_list_add": (_status, _handle, _camera, c_char_p, _error_out),
    "ptzcal_camera_list_read": (_status, c_char_p, c_uint32, _handle_out, _error_out),
    "ptzcal_camera_list_write": (_status, _handle, c_char_p, c_uint32, _error_out),
    "ptzcal_camera_list_count": (_status, _handle, _size_out, _uint32_out, _error_out),
    "ptzcal_camera_list_get": (_status, _handle, c_size_t, _camera, _uint32_out, _error_out),
    "ptzcal_camera_list_name": (c_char_p, _handle, c_size_t),
    # Files.
    "ptzcal_calibration_save": (_status, _handle, c_char_p, _error_out),
    "ptzcal_calibration_load_inputs": (
        _status, c_char_p, _handle_out, _handle_out, _error_out,
    ),
    "ptzcal_correspondences_add_csv": (_status, _handle, c_char_p, _size_out, _error_out),
    "ptzcal_correspondences_save_csv": (_status, _handle, c_char_p, _error_out),
    "ptzcal_camera_save": (_status, _camera, c_char_p, _error_out),
    "ptzcal_camera_load": (_status, c_char_p, _camera, _error_out),
    "ptzcal_camera_save_opencv": (_status, _camera, c_char_p, _error_out),
    "ptzcal_camera_load_opencv": (_status, c_char_p, _camera, _error_out),
    "ptzcal_scan_save_ply": (_status, _handle, c_char_p, _error_out),
}
# fmt: on


def _bind() -> ctypes.CDLL:
    library = _library.load()
    for name, (result, *parameters) in PROTOTYPES.items():
        try:
            function = getattr(library, name)
        except AttributeError:
            raise ImportError(
                f"{library._name} is older than this ptzcal package: it has no {name}"
            ) from None
        function.restype, function.argtypes = result, parameters
    return library


lib = _bind()


def taken_error(status: int, pointer: c_void_p) -> Error:
    """The exception for a failed call; frees the library's error object."""
    try:
        index = lib.ptzcal_error_index(pointer)
        message = lib.ptzcal_error_message(pointer).decode()
        hint = lib.ptzcal_error_hint(pointer).decode()
        return _error(status, message, index if index >= 0 else None, hint)
    finally:
        lib.ptzcal_error_free(pointer)


def call(function: Any, *arguments: Any) -> None:
    """Calls a function whose last parameter is the error; raises what it reports."""
    failure = c_void_p()
    status = function(*arguments, byref(failure))
    if status:
        raise taken_error(status, failure)


_S = TypeVar("_S", bound=Structure)
_INITIAL: Dict[type, bytes] = {}


def initial(kind: Type[_S]) -> _S:
    """A struct as its _init function sets it up."""
    try:
        return kind.from_buffer_copy(_INITIAL[kind])
    except KeyError:
        struct = kind()
        status = getattr(lib, f"{kind.__name__}_init")(byref(struct), sizeof(struct))
        if status:
            raise _error(status, f"{kind.__name__}_init refused {sizeof(struct)} bytes") from None
        _INITIAL[kind] = bytes(struct)
        return struct


def text(value: str, name: str) -> bytes:
    """A string for C, which would stop at a NUL inside."""
    if "\0" in value:
        raise ValueError(f"{name} holds a NUL")
    return value.encode()


def path(value: Path) -> bytes:
    """A file's name for C."""
    return text(os.fsdecode(value), "path")


_H = TypeVar("_H", bound="Handle")


class Handle:
    """Owns something that the library made; frees it with the last reference."""

    _free: str  # name of the function that frees it
    _pointer: Optional[int] = None

    def _make(self, function: Any, *arguments: Any) -> None:
        """Takes over what `function` makes: its last parameters are the handle and the error."""
        pointer = c_void_p()
        call(function, *arguments, byref(pointer))
        self._pointer = pointer.value

    @classmethod
    def _made(cls: Type[_H], by: Any, function: Any, *arguments: Any) -> _H:
        """As _make, of a function that may call back: `by` calls it."""
        made = cls.__new__(cls)
        pointer = c_void_p()
        try:
            by(function, *arguments, byref(pointer))
        finally:
            # A callback may have raised although the work was done.
            made._pointer = pointer.value
        return made

    def __del__(self, lib: Any = lib) -> None:
        pointer, self._pointer = self._pointer, None
        if pointer is not None:
            getattr(lib, self._free)(pointer)

    def __copy__(self) -> Any:
        raise TypeError(f"a {type(self).__name__} cannot be copied")

    def __deepcopy__(self, memo: Any) -> Any:
        raise TypeError(f"a {type(self).__name__} cannot be copied")

    def __reduce__(self) -> Any:
        raise TypeError(f"a {type(self).__name__} cannot be pickled")


def version() -> str:
    """Version of the loaded library, such as "0.1.0"."""
    return lib.ptzcal_version().decode()


def abi_version() -> int:
    """ABI number of the loaded library."""
    return lib.ptzcal_abi_version()
