"""The structs and callback types of include/ptzcal.h, in its order."""

from ctypes import (
    CFUNCTYPE,
    POINTER,
    Structure,
    c_char_p,
    c_double,
    c_int32,
    c_size_t,
    c_ssize_t,
    c_uint32,
    c_uint64,
    c_void_p,
)


class ptzcal_shot(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("index", c_uint32),
        ("pan", c_double),
        ("tilt", c_double),
        ("zoom", c_double),
        ("time", c_double),
        ("found", c_uint32),
        ("has_point", c_uint32),
        ("fixed_found", c_uint32),
        ("colour", c_uint32),
        ("point", c_double * 3),
        ("covariance", c_double * 9),
        ("inverse_depth", c_double),
        ("inverse_depth_variance", c_double),
        ("epipolar_chi2", c_double),
    ]


class ptzcal_progress(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("pass", c_uint32),
        ("passes", c_uint32),
        ("measured", c_uint32),
        ("done", c_uint64),
        ("total", c_uint64),
        ("elapsed", c_double),
        ("seconds_left", c_double),
        ("shot", POINTER(ptzcal_shot)),
    ]


class ptzcal_image(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("format", c_uint32),
        ("width", c_uint32),
        ("height", c_uint32),
        ("plane", c_void_p * 4),
        ("stride", c_ssize_t * 4),
        ("size", c_size_t * 4),
    ]


class ptzcal_camera(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("width", c_uint32),
        ("height", c_uint32),
        ("distortion_model", c_uint32),
        ("fx", c_double),
        ("fy", c_double),
        ("skew", c_double),
        ("cx", c_double),
        ("cy", c_double),
        ("distortion", c_double * 8),
        ("rotation", c_double * 9),
        ("translation", c_double * 3),
    ]


class ptzcal_rig_model(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("width", c_uint32),
        ("height", c_uint32),
        ("distortion_model", c_uint32),
        ("fx", c_double),
        ("fy", c_double),
        ("skew", c_double),
        ("cx", c_double),
        ("cy", c_double),
        ("distortion", c_double * 8),
        ("laser_x0", c_double),
        ("laser_y0", c_double),
        ("laser_vx", c_double),
        ("laser_vy", c_double),
        ("axis_tilt_y", c_double),
        ("axis_tilt_z", c_double),
        ("axis_pan_x", c_double),
        ("axis_pan_z", c_double),
        ("pan_zero", c_double),
        ("pan_scale", c_double),
        ("tilt_zero", c_double),
        ("tilt_scale", c_double),
    ]


class ptzcal_spot(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("saturated", c_uint32),
        ("x", c_double),
        ("y", c_double),
        ("covariance", c_double * 3),
        ("peak", c_double),
        ("signal_to_noise", c_double),
        ("area", c_uint64),
    ]


class ptzcal_chessboard_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("columns", c_uint32),
        ("rows", c_uint32),
        ("reserved", c_uint32),
        ("min_found", c_double),
    ]


class ptzcal_chessboard(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("columns", c_uint32),
        ("rows", c_uint32),
        ("found", c_uint32),
        ("blur", c_double),
    ]


class ptzcal_sift_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("max_features", c_uint32),
        ("upsample", c_uint32),
        ("reserved", c_uint32),
        ("contrast_threshold", c_double),
        ("edge_ratio", c_double),
    ]


class ptzcal_sift_match_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("mutual", c_uint32),
        ("max_ratio", c_double),
    ]


class ptzcal_rgbd_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("min_pairs", c_uint32),
        ("guided", c_uint32),
        ("lines", c_uint32),
        ("contrast_threshold", c_double),
        ("edge_ratio", c_double),
        ("max_ratio", c_double),
        ("inverse_depth_sigma", c_double),
        ("depth_sigma", c_double),
        ("keypoint_sigma", c_double),
    ]


class ptzcal_rgbd_view(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("features", c_uint32),
        ("with_depth", c_uint32),
        ("matches", c_uint32),
        ("pairs", c_uint32),
        ("lines", c_uint32),
    ]


class ptzcal_line_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("max_segments", c_uint32),
        ("min_length", c_double),
        ("min_contrast", c_double),
        ("max_gap", c_double),
    ]


class ptzcal_line_fit_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("robust", c_uint32),
        ("seed", c_uint64),
        ("sigma", c_double),
        ("outlier_threshold", c_double),
        ("min_inliers", c_double),
    ]


class ptzcal_line_match_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("same_polarity", c_uint32),
        ("camera_sigma", c_double),
        ("max_distance", c_double),
        ("min_lead", c_double),
        ("min_overlap", c_double),
    ]


class ptzcal_calibration_summary(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("iterations", c_uint32),
        ("measurements", c_uint64),
        ("inliers", c_uint64),
        ("parameters", c_uint64),
        ("rms", c_double),
        ("noise_factor", c_double),
        ("condition", c_double),
        ("chi2", c_double),
        ("degrees_of_freedom", c_uint64),
        ("probability", c_double),
        ("warnings", c_uint64),
    ]


class ptzcal_board_view(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("used", c_uint32),
        ("corners", c_uint64),
        ("inliers", c_uint64),
        ("rms", c_double),
        ("rotation", c_double * 9),
        ("translation", c_double * 3),
        ("covariance", c_double * 36),
    ]


class ptzcal_laser_line(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("spots", c_uint32),
        ("x0", c_double),
        ("y0", c_double),
        ("vx", c_double),
        ("vy", c_double),
        ("rms", c_double),
        ("covariance", c_double * 49),
    ]


class ptzcal_zoom_position(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("status", c_int32),
        ("laser_status", c_int32),
        ("has_model", c_uint32),
        ("views", c_uint32),
        ("views_used", c_uint32),
        ("spots_used", c_uint32),
        ("reserved", c_uint32),
        ("zoom", c_double),
        ("rms", c_double),
    ]


class ptzcal_common_line(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("agrees", c_uint32),
        ("positions", c_uint32),
        ("degrees_of_freedom", c_uint32),
        ("x0", c_double),
        ("y0", c_double),
        ("vx", c_double),
        ("vy", c_double),
        ("covariance", c_double * 16),
        ("chi2", c_double),
        ("probability", c_double),
        ("odd_zoom", c_double),
    ]


class ptzcal_rig_view(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("status", c_int32),
        ("spot_status", c_int32),
        ("has_spot", c_uint32),
        ("has_pose", c_uint32),
        ("reserved", c_uint32),
        ("corners", c_uint64),
        ("inliers", c_uint64),
        ("zoom", c_double),
        ("rms", c_double),
        ("spot", c_double * 2),
        ("spot_residual", c_double * 2),
        ("rotation", c_double * 9),
        ("translation", c_double * 3),
    ]


class ptzcal_pose(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("reserved", c_uint32),
        ("rotation", c_double * 9),
        ("translation", c_double * 3),
        ("rotation_angle", c_double),
        ("residual_rms", c_double),
        ("disagreement", c_double),
        ("condition", c_double),
    ]


class ptzcal_planes_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("min_points", c_uint32),
        ("max_planes", c_uint32),
        ("reserved", c_uint32),
        ("seed", c_uint64),
        ("threshold", c_double),
        ("flatness", c_double),
        ("min_share", c_double),
        ("min_range", c_double),
        ("max_range", c_double),
    ]


class ptzcal_plane(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("count", c_uint32),
        ("n", c_double * 3),
        ("covariance", c_double * 9),
        ("centre", c_double * 3),
        ("axes", c_double * 6),
        ("extent", c_double * 4),
        ("area", c_double),
        ("rms", c_double),
        ("noise_factor", c_double),
    ]


class ptzcal_station_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("has_prior", c_uint32),
        ("max_angle", c_double),
        ("max_distance", c_double),
        ("min_agreement", c_double),
        ("max_runner_up", c_double),
        ("prior_rotation", c_double * 9),
        ("prior_translation", c_double * 3),
        ("prior_rotation_sigma", c_double),
        ("prior_position_sigma", c_double),
    ]


class ptzcal_station_pose(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("matches", c_uint32),
        ("rotation", c_double * 9),
        ("translation", c_double * 3),
        ("covariance", c_double * 36),
        ("chi2", c_double),
        ("degrees_of_freedom", c_double),
        ("condition", c_double),
        ("agreement", c_double),
        ("runner_up", c_double),
    ]


class ptzcal_head_capabilities(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("raw_units", c_uint32),
        ("pan_min", c_double),
        ("pan_max", c_double),
        ("tilt_min", c_double),
        ("tilt_max", c_double),
        ("pan_step", c_double),
        ("tilt_step", c_double),
        ("pan_speed", c_double),
        ("tilt_speed", c_double),
        ("presets", c_uint32),
        ("reports_motion", c_uint32),
        ("reports_position", c_uint32),
        ("has_drive", c_uint32),
        ("has_relative", c_uint32),
        ("has_home", c_uint32),
        ("has_zoom", c_uint32),
        ("has_focus", c_uint32),
        ("has_exposure_lock", c_uint32),
        ("has_view_moves", c_uint32),
    ]


class ptzcal_angle_summary(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("frames", c_uint32),
        ("pairs", c_uint32),
        ("reserved", c_uint32),
        ("raw", c_double * 4),
        ("angles", c_double * 4),
        ("mounting", c_double * 3),
        ("mounting_sigma", c_double * 3),
        ("rms", c_double),
        ("outliers", c_double),
        ("repeatability", c_double * 2),
        ("parallax", c_double),
        ("parallax_sigma", c_double),
    ]


class ptzcal_angle_learning_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("min_positions", c_uint32),
        ("max_frames", c_uint32),
        ("reserved", c_uint32),
        ("step", c_double),
        ("scene_nearest", c_double),
        ("scene_farthest", c_double),
        ("levers", c_double * 4),
        ("lever_sigma", c_double),
        ("min_cover", c_double),
        ("max_rms", c_double),
    ]


class ptzcal_probe_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("repeats", c_uint32),
        ("reach_limits", c_uint32),
        ("toggle_laser", c_uint32),
        ("amplitude", c_double),
        ("max_time", c_double),
    ]


class ptzcal_figure(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("count", c_uint32),
        ("value", c_double),
        ("sigma", c_double),
    ]


class ptzcal_region(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("pan_steps", c_uint32),
        ("tilt_steps", c_uint32),
        ("reserved", c_uint32),
        ("pan_min", c_double),
        ("pan_max", c_double),
        ("tilt_min", c_double),
        ("tilt_max", c_double),
    ]


class ptzcal_scan_summary(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("complete", c_uint32),
        ("positions", c_uint64),
        ("shots", c_uint64),
        ("resumed", c_uint64),
        ("found", c_uint64),
        ("fixed_cameras", c_uint64),
        ("journal_damaged", c_uint64),
        ("journal_cut", c_uint64),
    ]


class ptzcal_surface_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("reserved", c_uint32),
        ("max_incidence", c_double),
        ("significance", c_double),
    ]


class ptzcal_adjusted_summary(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("iterations", c_uint32),
        ("parameters", c_uint64),
        ("stations", c_uint64),
        ("cameras", c_uint64),
        ("shots", c_uint64),
        ("spots", c_uint64),
        ("used", c_uint64),
        ("warnings", c_uint64),
        ("suspects", c_uint64),
        ("prior_only", c_uint64),
        ("degrees_of_freedom", c_uint64),
        ("chi2", c_double),
        ("probability", c_double),
        ("noise_factor", c_double),
        ("condition", c_double),
        ("planes", c_uint64),
    ]


class ptzcal_suspect(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("parameters", c_uint32),
        ("gain", c_double),
        ("probability", c_double),
    ]


class ptzcal_tie_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("reserved", c_uint32),
        ("planes", POINTER(ptzcal_planes_options)),
        ("stations", POINTER(ptzcal_station_options)),
        ("pairs", c_void_p),
        ("pair_count", c_size_t),
        ("min_closure", c_double),
    ]


class ptzcal_ties_summary(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("links", c_uint32),
        ("linked", c_uint32),
        ("loops", c_uint32),
        ("planes", c_uint64),
        ("shots", c_uint64),
    ]


class ptzcal_link(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("status", c_int32),
        ("station_a", c_uint32),
        ("station_b", c_uint32),
    ]


class ptzcal_loop(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("stations", c_uint32),
        ("rotation", c_double),
        ("position", c_double),
        ("probability", c_double),
    ]


class ptzcal_adjust_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("robust", c_uint32),
        ("max_iterations", c_uint32),
        ("reserved", c_uint32),
        ("seed", c_uint64),
        ("pointing_sigma_pan", c_double),
        ("pointing_sigma_tilt", c_double),
        ("huber", c_double),
        ("max_focal_deviation", c_double),
        ("max_station_deviation", c_double),
    ]


class ptzcal_study_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("methods", c_uint32),
        ("draws", c_uint32),
        ("trials", c_uint32),
        ("threads", c_uint32),
        ("reserved", c_uint32),
        ("seed", c_uint64),
    ]


class ptzcal_study_cell(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("used", c_uint32),
        ("failures", c_uint32),
        ("reserved", c_uint32),
        ("head_sigma", c_double),
        ("fixed_sigma", c_double),
        ("mean", c_double * 4),
        ("rms", c_double * 4),
        ("bias", c_double * 4),
        ("expected", c_double * 4),
    ]


class ptzcal_label_row(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("shots", c_uint32),
        ("failures", c_uint32),
        ("reserved", c_uint32),
        ("distance", c_double),
        ("head_sigma", c_double),
        ("fixed_sigma", c_double),
        ("simulated", c_double * 4),
        ("expected", c_double * 4),
        ("handoff_simulated", c_double),
        ("handoff_expected", c_double),
    ]


class ptzcal_plan_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("max_positions", c_uint32),
        ("pan_min", c_double),
        ("pan_max", c_double),
        ("tilt_min", c_double),
        ("tilt_max", c_double),
        ("head_sigma", c_double),
        ("fixed_sigma", c_double),
        ("target", c_double),
    ]


class ptzcal_plan_summary(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("pan_steps", c_uint32),
        ("tilt_steps", c_uint32),
        ("grid_seen", c_uint32),
        ("shots", c_uint32),
        ("limited_by", c_int32),
        ("grid_rms", c_double),
        ("grid_semi_axis", c_double),
        ("limit_rms", c_double),
    ]


ptzcal_log_fn = CFUNCTYPE(None, c_void_p, c_int32, c_char_p)
ptzcal_move_end_fn = CFUNCTYPE(
    None, c_void_p, c_uint64, c_int32, c_int32, c_double, c_double
)
ptzcal_progress_fn = CFUNCTYPE(c_int32, c_void_p, POINTER(ptzcal_progress))
ptzcal_ptz_move_fn = CFUNCTYPE(c_int32, c_void_p, c_double, c_double)
ptzcal_ptz_position_fn = CFUNCTYPE(
    c_int32, c_void_p, POINTER(c_double), POINTER(c_double), POINTER(c_double)
)
ptzcal_ptz_motion_fn = CFUNCTYPE(c_int32, c_void_p, POINTER(c_int32))
ptzcal_ptz_stop_fn = CFUNCTYPE(c_int32, c_void_p)
ptzcal_laser_fn = CFUNCTYPE(c_int32, c_void_p, c_int32)
ptzcal_frame_fn = CFUNCTYPE(
    c_int32, c_void_p, c_double, c_double, POINTER(ptzcal_image), POINTER(c_double)
)
ptzcal_clock_now_fn = CFUNCTYPE(c_double, c_void_p)
ptzcal_clock_sleep_fn = CFUNCTYPE(None, c_void_p, c_double)


class ptzcal_ptz(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("raw_units", c_uint32),
        ("pan_min", c_double),
        ("pan_max", c_double),
        ("tilt_min", c_double),
        ("tilt_max", c_double),
        ("pan_step", c_double),
        ("tilt_step", c_double),
        ("user", c_void_p),
        ("move_absolute", ptzcal_ptz_move_fn),
        ("position", ptzcal_ptz_position_fn),
        ("motion", ptzcal_ptz_motion_fn),
        ("stop", ptzcal_ptz_stop_fn),
    ]


class ptzcal_explore_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("max_shots", c_uint32),
        ("reserved", c_uint32 * 2),
        ("pan_min", c_double),
        ("pan_max", c_double),
        ("tilt_min", c_double),
        ("tilt_max", c_double),
        ("tolerance", c_double),
        ("spacing", c_double),
    ]


class ptzcal_visible(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("shots", c_uint32),
        ("seen", c_uint32),
        ("measured", c_uint32),
        ("share", c_double),
    ]


class ptzcal_health_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("reserved", c_uint32),
        ("false_alarm", c_double),
        ("pan_sigma", c_double),
        ("tilt_sigma", c_double),
    ]


class ptzcal_health(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("verdict", c_uint32),
        ("has_statistic", c_uint32),
        ("has_refit", c_uint32),
        ("has_head_shift", c_uint32),
        ("shots", c_uint32),
        ("used", c_uint32),
        ("not_seen", c_uint32),
        ("scene_changed", c_uint32),
        ("outliers", c_uint32),
        ("chi2", c_double),
        ("degrees_of_freedom", c_double),
        ("probability", c_double),
        ("change", c_double * 6),
        ("change_covariance", c_double * 36),
        ("head_shift", c_double * 2),
        ("head_shift_covariance", c_double * 3),
    ]


class ptzcal_aim(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("has_zoom", c_uint32),
        ("edge", c_uint32),
        ("reserved", c_uint32),
        ("pan", c_double),
        ("tilt", c_double),
        ("angle_covariance", c_double * 3),
        ("zoom", c_double),
        ("probability", c_double),
        ("uv", c_double * 2),
        ("uv_covariance", c_double * 3),
        ("point", c_double * 3),
        ("point_covariance", c_double * 9),
        ("distance", c_double),
        ("other_distance", c_double),
    ]


class ptzcal_located(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("edge", c_uint32),
        ("hidden", c_uint32),
        ("reserved", c_uint32),
        ("uv", c_double * 2),
        ("uv_covariance", c_double * 3),
        ("point", c_double * 3),
        ("point_covariance", c_double * 9),
        ("distance", c_double),
        ("other_distance", c_double),
    ]


class ptzcal_sweep_summary(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("steps", c_uint32),
        ("points", c_uint32),
        ("has_zoom", c_uint32),
        ("pan_min", c_double),
        ("pan_max", c_double),
        ("tilt_min", c_double),
        ("tilt_max", c_double),
        ("middle_pan", c_double),
        ("middle_tilt", c_double),
        ("zoom", c_double),
        ("probability", c_double),
    ]
