//! Size and offsets of every public struct, as the C compiler and as Rust lay them out; and the
//! header by itself in every standard that its users compile with.

use std::fmt::Write as _;
use std::fs;
use std::mem::{offset_of, size_of};
use std::process::Command;

use ptzcal::capi::adjust::ptzcal_adjust_options;
use ptzcal::capi::adjusted::ptzcal_adjusted_summary;
use ptzcal::capi::adjusted_check::ptzcal_suspect;
use ptzcal::capi::angle_learning::ptzcal_angle_learning_options;
use ptzcal::capi::angle_map::ptzcal_angle_summary;
use ptzcal::capi::boards::ptzcal_board_view;
use ptzcal::capi::calibrate::ptzcal_calibration_summary;
use ptzcal::capi::camera::ptzcal_camera;
use ptzcal::capi::chessboard::{ptzcal_chessboard, ptzcal_chessboard_options};
use ptzcal::capi::detect::ptzcal_spot;
use ptzcal::capi::devices::ptzcal_ptz;
use ptzcal::capi::explore::{ptzcal_explore_options, ptzcal_visible};
use ptzcal::capi::head::ptzcal_head_capabilities;
use ptzcal::capi::health::{ptzcal_health, ptzcal_health_options};
use ptzcal::capi::image::ptzcal_image;
use ptzcal::capi::label::ptzcal_label_row;
use ptzcal::capi::laser_line::ptzcal_laser_line;
use ptzcal::capi::lines::ptzcal_line_options;
use ptzcal::capi::lines_3d::{ptzcal_line_fit_options, ptzcal_line_match_options};
use ptzcal::capi::locating::{ptzcal_aim, ptzcal_located};
use ptzcal::capi::mesh::ptzcal_surface_options;
use ptzcal::capi::network::{ptzcal_link, ptzcal_loop, ptzcal_tie_options, ptzcal_ties_summary};
use ptzcal::capi::plan::{ptzcal_plan_options, ptzcal_plan_summary};
use ptzcal::capi::planes::{ptzcal_plane, ptzcal_planes_options};
use ptzcal::capi::pose::ptzcal_pose;
use ptzcal::capi::probe::{ptzcal_figure, ptzcal_probe_options};
use ptzcal::capi::progress::ptzcal_progress;
use ptzcal::capi::registration::{ptzcal_station_options, ptzcal_station_pose};
use ptzcal::capi::rgbd::{ptzcal_rgbd_options, ptzcal_rgbd_view};
use ptzcal::capi::rig_calibrated::{ptzcal_common_line, ptzcal_zoom_position};
use ptzcal::capi::rig_model::ptzcal_rig_model;
use ptzcal::capi::rig_views::ptzcal_rig_view;
use ptzcal::capi::scan::{ptzcal_region, ptzcal_scan_summary};
use ptzcal::capi::shot::ptzcal_shot;
use ptzcal::capi::sift::ptzcal_sift_options;
use ptzcal::capi::sift_matching::ptzcal_sift_match_options;
use ptzcal::capi::study::{ptzcal_study_cell, ptzcal_study_options};
use ptzcal::capi::sweep::ptzcal_sweep_summary;

use super::tools::{run, strict, text};
use super::{declarations, header};

macro_rules! layout {
    ($out:ident, $type:ident: $($member:ident)+) => {
        writeln!($out, "{} {}", stringify!($type), size_of::<$type>()).unwrap();
        $(writeln!($out, "{}.{} {}", stringify!($type), stringify!($member), offset_of!($type, $member)).unwrap();)+
    };
}

/// In the order of the header.
fn rust() -> String {
    let mut out = String::new();
    layout!(out, ptzcal_shot: struct_size index pan tilt zoom time found has_point fixed_found colour
        point covariance inverse_depth inverse_depth_variance epipolar_chi2);
    layout!(out, ptzcal_progress: struct_size pass passes measured done total elapsed
        seconds_left shot);
    layout!(out, ptzcal_image: struct_size format width height plane stride size);
    layout!(out, ptzcal_camera: struct_size width height distortion_model fx fy skew cx cy
        distortion rotation translation);
    layout!(out, ptzcal_rig_model: struct_size width height distortion_model fx fy skew cx cy
        distortion laser_x0 laser_y0 laser_vx laser_vy axis_tilt_y axis_tilt_z axis_pan_x axis_pan_z
        pan_zero pan_scale tilt_zero tilt_scale);
    layout!(out, ptzcal_spot: struct_size saturated x y covariance peak signal_to_noise area);
    layout!(out, ptzcal_chessboard_options: struct_size columns rows reserved min_found);
    layout!(out, ptzcal_chessboard: struct_size columns rows found blur);
    layout!(out, ptzcal_sift_options: struct_size max_features upsample reserved contrast_threshold edge_ratio);
    layout!(out, ptzcal_sift_match_options: struct_size mutual max_ratio);
    layout!(out, ptzcal_line_options: struct_size max_segments min_length min_contrast max_gap);
    layout!(out, ptzcal_line_fit_options: struct_size robust seed sigma outlier_threshold min_inliers);
    layout!(out, ptzcal_line_match_options: struct_size same_polarity camera_sigma max_distance min_lead
        min_overlap);
    layout!(out, ptzcal_calibration_summary: struct_size iterations measurements inliers parameters
        rms noise_factor condition chi2 degrees_of_freedom probability warnings);
    layout!(out, ptzcal_board_view: struct_size used corners inliers rms rotation translation covariance);
    layout!(out, ptzcal_laser_line: struct_size spots x0 y0 vx vy rms covariance);
    layout!(out, ptzcal_zoom_position: struct_size status laser_status has_model views views_used spots_used
        reserved zoom rms);
    layout!(out, ptzcal_common_line: struct_size agrees positions degrees_of_freedom x0 y0 vx vy covariance
        chi2 probability odd_zoom);
    layout!(out, ptzcal_rig_view: struct_size status spot_status has_spot has_pose reserved corners inliers
        zoom rms spot spot_residual rotation translation);
    layout!(out, ptzcal_rgbd_options: struct_size min_pairs guided lines contrast_threshold edge_ratio
        max_ratio inverse_depth_sigma depth_sigma keypoint_sigma);
    layout!(out, ptzcal_rgbd_view: struct_size features with_depth matches pairs lines);
    layout!(out, ptzcal_pose: struct_size reserved rotation translation rotation_angle residual_rms
        disagreement condition);
    layout!(out, ptzcal_planes_options: struct_size min_points max_planes reserved seed threshold flatness
        min_share min_range max_range);
    layout!(out, ptzcal_plane: struct_size count n covariance centre axes extent area rms noise_factor);
    layout!(out, ptzcal_station_options: struct_size has_prior max_angle max_distance min_agreement
        max_runner_up prior_rotation prior_translation prior_rotation_sigma prior_position_sigma);
    layout!(out, ptzcal_station_pose: struct_size matches rotation translation covariance chi2
        degrees_of_freedom condition agreement runner_up);
    layout!(out, ptzcal_ptz: struct_size raw_units pan_min pan_max tilt_min tilt_max pan_step tilt_step
        user move_absolute position motion stop);
    layout!(out, ptzcal_angle_summary: struct_size frames pairs reserved raw angles mounting mounting_sigma rms outliers repeatability parallax parallax_sigma);
    layout!(out, ptzcal_head_capabilities: struct_size raw_units pan_min pan_max tilt_min tilt_max pan_step tilt_step pan_speed tilt_speed presets reports_motion reports_position has_drive has_relative has_home has_zoom has_focus has_exposure_lock has_view_moves);
    layout!(out, ptzcal_angle_learning_options: struct_size min_positions max_frames reserved step scene_nearest scene_farthest levers lever_sigma min_cover max_rms);
    layout!(out, ptzcal_probe_options: struct_size repeats reach_limits toggle_laser amplitude max_time);
    layout!(out, ptzcal_figure: struct_size count value sigma);
    layout!(out, ptzcal_region: struct_size pan_steps tilt_steps reserved pan_min pan_max tilt_min tilt_max);
    layout!(out, ptzcal_scan_summary: struct_size complete positions shots resumed found fixed_cameras
        journal_damaged journal_cut);
    layout!(out, ptzcal_surface_options: struct_size reserved max_incidence significance);
    layout!(out, ptzcal_explore_options: struct_size max_shots reserved pan_min pan_max tilt_min tilt_max
        tolerance spacing);
    layout!(out, ptzcal_visible: struct_size shots seen measured share);
    layout!(out, ptzcal_health_options: struct_size reserved false_alarm pan_sigma tilt_sigma);
    layout!(out, ptzcal_health: struct_size verdict has_statistic has_refit has_head_shift shots used not_seen
        scene_changed outliers chi2 degrees_of_freedom probability change change_covariance head_shift
        head_shift_covariance);
    layout!(out, ptzcal_adjusted_summary: struct_size iterations parameters stations cameras shots spots
        used warnings suspects prior_only degrees_of_freedom chi2 probability noise_factor condition planes);
    layout!(out, ptzcal_suspect: struct_size parameters gain probability);
    layout!(out, ptzcal_tie_options: struct_size reserved planes stations pairs pair_count min_closure);
    layout!(out, ptzcal_ties_summary: struct_size links linked loops planes shots);
    layout!(out, ptzcal_link: struct_size status station_a station_b);
    layout!(out, ptzcal_loop: struct_size stations rotation position probability);
    layout!(out, ptzcal_adjust_options: struct_size robust max_iterations reserved seed
        pointing_sigma_pan pointing_sigma_tilt huber max_focal_deviation max_station_deviation);
    layout!(out, ptzcal_study_options: struct_size methods draws trials threads reserved seed);
    layout!(out, ptzcal_study_cell: struct_size used failures reserved head_sigma fixed_sigma mean rms bias expected);
    layout!(out, ptzcal_label_row: struct_size shots failures reserved distance head_sigma fixed_sigma simulated
        expected handoff_simulated handoff_expected);
    layout!(out, ptzcal_plan_options: struct_size max_positions pan_min pan_max tilt_min tilt_max head_sigma
        fixed_sigma target);
    layout!(out, ptzcal_plan_summary: struct_size pan_steps tilt_steps grid_seen shots limited_by grid_rms
        grid_semi_axis limit_rms);
    layout!(out, ptzcal_aim: struct_size has_zoom edge reserved pan tilt angle_covariance zoom probability uv
        uv_covariance point point_covariance distance other_distance);
    layout!(out, ptzcal_located: struct_size edge hidden reserved uv uv_covariance point point_covariance distance
        other_distance);
    layout!(out, ptzcal_sweep_summary: struct_size steps points has_zoom pan_min pan_max tilt_min tilt_max
        middle_pan middle_tilt zoom probability);
    out
}

#[test]
fn c_lays_structs_out_as_rust_does() {
    let folder = tempfile::tempdir().unwrap();
    let (source, program) = (folder.path().join("layout.c"), folder.path().join("layout"));
    let mut code = "#include <ptzcal.h>\n#include <stdio.h>\nint main(void) {\n".to_owned();
    let structs = declarations::read().structs;
    for s in &structs {
        writeln!(code, "  printf(\"{0} %zu\\n\", sizeof({0}));", s.name).unwrap();
        for m in &s.members {
            writeln!(code, "  printf(\"{0}.{m} %zu\\n\", offsetof({0}, {m}));", s.name).unwrap();
        }
    }
    fs::write(&source, code + "  return 0;\n}\n").unwrap();
    run(strict(false, "c99").arg(&source).arg("-o").arg(&program));
    assert_eq!(text(&run(&mut Command::new(program))), rust());
}

/// Padding would let a new member slip into what an older program believes to be garbage.
#[test]
fn structs_have_no_padding() {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("padding.c");
    let structs = declarations::read().structs;
    let uses: String = structs.iter().map(|s| format!("{0} use_{0};\n", s.name)).collect();
    fs::write(&source, format!("#include <ptzcal.h>\n{uses}")).unwrap();
    run(strict(false, "c99").args(["-Wpadded", "-c", "-o", "/dev/null"]).arg(&source));
}

#[test]
fn the_header_alone_compiles_in_every_standard() {
    for (cpp, standard) in [(false, "c99"), (false, "c11"), (true, "c++11"), (true, "c++17"), (true, "c++20")] {
        let language = if cpp { "c++" } else { "c" };
        run(strict(cpp, standard).args(["-Wshadow", "-Wundef", "-fsyntax-only", "-x", language]).arg(header::path()));
    }
}
