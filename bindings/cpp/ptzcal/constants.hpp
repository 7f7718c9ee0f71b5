// Made from ptzcal.h (make header): do not edit.
//
// An enum of the C API is a type of its own here, which turns into the number that the C structs hold:
// camera.distortion_model = distortion_model::radial2; numbers of structs turn into it when asked:
// distortion_model(camera.distortion_model).
#ifndef PTZCAL_CONSTANTS_HPP
#define PTZCAL_CONSTANTS_HPP

#include <ptzcal.h>

#include "mode.hpp"

#include <cstdint>

PTZCAL_BEGIN

struct status {
  enum value : std::int32_t {
    ok = PTZCAL_STATUS_OK,
    invalid_argument = PTZCAL_STATUS_INVALID_ARGUMENT,
    null_pointer = PTZCAL_STATUS_NULL_POINTER,
    not_finite = PTZCAL_STATUS_NOT_FINITE,
    buffer_too_small = PTZCAL_STATUS_BUFFER_TOO_SMALL,
    unsupported = PTZCAL_STATUS_UNSUPPORTED,
    busy = PTZCAL_STATUS_BUSY,
    bad_state = PTZCAL_STATUS_BAD_STATE,
    invalid_address = PTZCAL_STATUS_INVALID_ADDRESS,
    too_few_points = PTZCAL_STATUS_TOO_FEW_POINTS,
    degenerate = PTZCAL_STATUS_DEGENERATE,
    no_convergence = PTZCAL_STATUS_NO_CONVERGENCE,
    no_consensus = PTZCAL_STATUS_NO_CONSENSUS,
    lens_not_monotone = PTZCAL_STATUS_LENS_NOT_MONOTONE,
    behind_camera = PTZCAL_STATUS_BEHIND_CAMERA,
    unreachable = PTZCAL_STATUS_UNREACHABLE,
    outside_lens = PTZCAL_STATUS_OUTSIDE_LENS,
    not_found = PTZCAL_STATUS_NOT_FOUND,
    ambiguous = PTZCAL_STATUS_AMBIGUOUS,
    device = PTZCAL_STATUS_DEVICE,
    device_lost = PTZCAL_STATUS_DEVICE_LOST,
    device_timeout = PTZCAL_STATUS_DEVICE_TIMEOUT,
    laser_refused = PTZCAL_STATUS_LASER_REFUSED,
    device_not_found = PTZCAL_STATUS_DEVICE_NOT_FOUND,
    device_permission = PTZCAL_STATUS_DEVICE_PERMISSION,
    device_busy = PTZCAL_STATUS_DEVICE_BUSY,
    device_mismatch = PTZCAL_STATUS_DEVICE_MISMATCH,
    device_garbled = PTZCAL_STATUS_DEVICE_GARBLED,
    device_refused = PTZCAL_STATUS_DEVICE_REFUSED,
    unauthorised = PTZCAL_STATUS_UNAUTHORISED,
    file_io = PTZCAL_STATUS_FILE_IO,
    file_format = PTZCAL_STATUS_FILE_FORMAT,
    file_version = PTZCAL_STATUS_FILE_VERSION,
    file_mismatch = PTZCAL_STATUS_FILE_MISMATCH,
    disk_full = PTZCAL_STATUS_DISK_FULL,
    cancelled = PTZCAL_STATUS_CANCELLED,
    internal = PTZCAL_STATUS_INTERNAL,
    panic = PTZCAL_STATUS_PANIC,
  };
  constexpr status() noexcept = default;
  constexpr status(value known) noexcept : number_(known) {}
  explicit constexpr status(std::int32_t number) noexcept : number_(number) {}
  constexpr operator std::int32_t() const noexcept { return number_; }

 private:
  std::int32_t number_ = 0;
};

struct log_level {
  enum value : std::int32_t {
    error = PTZCAL_LOG_LEVEL_ERROR,
    warning = PTZCAL_LOG_LEVEL_WARNING,
    info = PTZCAL_LOG_LEVEL_INFO,
    debug = PTZCAL_LOG_LEVEL_DEBUG,
  };
  constexpr log_level() noexcept = default;
  constexpr log_level(value known) noexcept : number_(known) {}
  explicit constexpr log_level(std::int32_t number) noexcept : number_(number) {}
  constexpr operator std::int32_t() const noexcept { return number_; }

 private:
  std::int32_t number_ = 0;
};

struct pixel_format {
  enum value : std::uint32_t {
    gray8 = PTZCAL_PIXEL_FORMAT_GRAY8,
    rgb24 = PTZCAL_PIXEL_FORMAT_RGB24,
    bgr24 = PTZCAL_PIXEL_FORMAT_BGR24,
    rgba32 = PTZCAL_PIXEL_FORMAT_RGBA32,
    bgra32 = PTZCAL_PIXEL_FORMAT_BGRA32,
    yuyv = PTZCAL_PIXEL_FORMAT_YUYV,
    nv12 = PTZCAL_PIXEL_FORMAT_NV12,
    i420 = PTZCAL_PIXEL_FORMAT_I420,
  };
  constexpr pixel_format() noexcept = default;
  constexpr pixel_format(value known) noexcept : number_(known) {}
  explicit constexpr pixel_format(std::uint32_t number) noexcept : number_(number) {}
  constexpr operator std::uint32_t() const noexcept { return number_; }

 private:
  std::uint32_t number_ = 0;
};

struct distortion_model {
  enum value : std::uint32_t {
    none = PTZCAL_DISTORTION_MODEL_NONE,
    radial1 = PTZCAL_DISTORTION_MODEL_RADIAL1,
    radial2 = PTZCAL_DISTORTION_MODEL_RADIAL2,
    brown_conrady = PTZCAL_DISTORTION_MODEL_BROWN_CONRADY,
    division = PTZCAL_DISTORTION_MODEL_DIVISION,
    fisheye = PTZCAL_DISTORTION_MODEL_FISHEYE,
  };
  constexpr distortion_model() noexcept = default;
  constexpr distortion_model(value known) noexcept : number_(known) {}
  explicit constexpr distortion_model(std::uint32_t number) noexcept : number_(number) {}
  constexpr operator std::uint32_t() const noexcept { return number_; }

 private:
  std::uint32_t number_ = 0;
};

struct laser_colour {
  enum value : std::uint32_t {
    unknown = PTZCAL_LASER_COLOUR_UNKNOWN,
    red = PTZCAL_LASER_COLOUR_RED,
    green = PTZCAL_LASER_COLOUR_GREEN,
    blue = PTZCAL_LASER_COLOUR_BLUE,
    white = PTZCAL_LASER_COLOUR_WHITE,
  };
  constexpr laser_colour() noexcept = default;
  constexpr laser_colour(value known) noexcept : number_(known) {}
  explicit constexpr laser_colour(std::uint32_t number) noexcept : number_(number) {}
  constexpr operator std::uint32_t() const noexcept { return number_; }

 private:
  std::uint32_t number_ = 0;
};

struct pose_method {
  enum value : std::uint32_t {
    roof_edge_procrustes = PTZCAL_POSE_METHOD_ROOF_EDGE_PROCRUSTES,
    plane_to_plane = PTZCAL_POSE_METHOD_PLANE_TO_PLANE,
    maximum_likelihood = PTZCAL_POSE_METHOD_MAXIMUM_LIKELIHOOD,
  };
  constexpr pose_method() noexcept = default;
  constexpr pose_method(value known) noexcept : number_(known) {}
  explicit constexpr pose_method(std::uint32_t number) noexcept : number_(number) {}
  constexpr operator std::uint32_t() const noexcept { return number_; }

 private:
  std::uint32_t number_ = 0;
};

struct motion {
  enum value : std::int32_t {
    idle = PTZCAL_MOTION_IDLE,
    moving = PTZCAL_MOTION_MOVING,
    failed = PTZCAL_MOTION_FAILED,
    unknown = PTZCAL_MOTION_UNKNOWN,
  };
  constexpr motion() noexcept = default;
  constexpr motion(value known) noexcept : number_(known) {}
  explicit constexpr motion(std::int32_t number) noexcept : number_(number) {}
  constexpr operator std::int32_t() const noexcept { return number_; }

 private:
  std::int32_t number_ = 0;
};

struct move_end {
  enum value : std::int32_t {
    arrived = PTZCAL_MOVE_END_ARRIVED,
    missed = PTZCAL_MOVE_END_MISSED,
    stopped = PTZCAL_MOVE_END_STOPPED,
    dead_man = PTZCAL_MOVE_END_DEAD_MAN,
    replaced = PTZCAL_MOVE_END_REPLACED,
    unknown = PTZCAL_MOVE_END_UNKNOWN,
    failed = PTZCAL_MOVE_END_FAILED,
  };
  constexpr move_end() noexcept = default;
  constexpr move_end(value known) noexcept : number_(known) {}
  explicit constexpr move_end(std::int32_t number) noexcept : number_(number) {}
  constexpr operator std::int32_t() const noexcept { return number_; }

 private:
  std::int32_t number_ = 0;
};

struct identity {
  enum value : std::uint32_t {
    protocol = PTZCAL_IDENTITY_PROTOCOL,
    vendor = PTZCAL_IDENTITY_VENDOR,
    model = PTZCAL_IDENTITY_MODEL,
    firmware = PTZCAL_IDENTITY_FIRMWARE,
  };
  constexpr identity() noexcept = default;
  constexpr identity(value known) noexcept : number_(known) {}
  explicit constexpr identity(std::uint32_t number) noexcept : number_(number) {}
  constexpr operator std::uint32_t() const noexcept { return number_; }

 private:
  std::uint32_t number_ = 0;
};

struct focus {
  enum value : std::uint32_t {
    auto_ = PTZCAL_FOCUS_AUTO,
    manual = PTZCAL_FOCUS_MANUAL,
    at = PTZCAL_FOCUS_AT,
  };
  constexpr focus() noexcept = default;
  constexpr focus(value known) noexcept : number_(known) {}
  explicit constexpr focus(std::uint32_t number) noexcept : number_(number) {}
  constexpr operator std::uint32_t() const noexcept { return number_; }

 private:
  std::uint32_t number_ = 0;
};

struct probe_figure {
  enum value : std::uint32_t {
    pan_min = PTZCAL_PROBE_FIGURE_PAN_MIN,
    pan_max = PTZCAL_PROBE_FIGURE_PAN_MAX,
    tilt_min = PTZCAL_PROBE_FIGURE_TILT_MIN,
    tilt_max = PTZCAL_PROBE_FIGURE_TILT_MAX,
    pan_speed = PTZCAL_PROBE_FIGURE_PAN_SPEED,
    tilt_speed = PTZCAL_PROBE_FIGURE_TILT_SPEED,
    start_latency = PTZCAL_PROBE_FIGURE_START_LATENCY,
    position_time = PTZCAL_PROBE_FIGURE_POSITION_TIME,
    position_follows = PTZCAL_PROBE_FIGURE_POSITION_FOLLOWS,
    pan_error = PTZCAL_PROBE_FIGURE_PAN_ERROR,
    tilt_error = PTZCAL_PROBE_FIGURE_TILT_ERROR,
    pan_reading_repeatability = PTZCAL_PROBE_FIGURE_PAN_READING_REPEATABILITY,
    tilt_reading_repeatability = PTZCAL_PROBE_FIGURE_TILT_READING_REPEATABILITY,
    pan_repeatability_px = PTZCAL_PROBE_FIGURE_PAN_REPEATABILITY_PX,
    tilt_repeatability_px = PTZCAL_PROBE_FIGURE_TILT_REPEATABILITY_PX,
    pan_repeatability = PTZCAL_PROBE_FIGURE_PAN_REPEATABILITY,
    tilt_repeatability = PTZCAL_PROBE_FIGURE_TILT_REPEATABILITY,
    pan_backlash_px = PTZCAL_PROBE_FIGURE_PAN_BACKLASH_PX,
    tilt_backlash_px = PTZCAL_PROBE_FIGURE_TILT_BACKLASH_PX,
    pan_backlash = PTZCAL_PROBE_FIGURE_PAN_BACKLASH,
    tilt_backlash = PTZCAL_PROBE_FIGURE_TILT_BACKLASH,
    pan_smallest_move = PTZCAL_PROBE_FIGURE_PAN_SMALLEST_MOVE,
    tilt_smallest_move = PTZCAL_PROBE_FIGURE_TILT_SMALLEST_MOVE,
    stop_distance = PTZCAL_PROBE_FIGURE_STOP_DISTANCE,
    stop_time = PTZCAL_PROBE_FIGURE_STOP_TIME,
    moves_after_arrival = PTZCAL_PROBE_FIGURE_MOVES_AFTER_ARRIVAL,
    arrival_honest = PTZCAL_PROBE_FIGURE_ARRIVAL_HONEST,
    frame_interval = PTZCAL_PROBE_FIGURE_FRAME_INTERVAL,
    frame_age = PTZCAL_PROBE_FIGURE_FRAME_AGE,
    visible_after = PTZCAL_PROBE_FIGURE_VISIBLE_AFTER,
    visible_after_frames = PTZCAL_PROBE_FIGURE_VISIBLE_AFTER_FRAMES,
    laser_visible_after = PTZCAL_PROBE_FIGURE_LASER_VISIBLE_AFTER,
    laser_visible_after_frames = PTZCAL_PROBE_FIGURE_LASER_VISIBLE_AFTER_FRAMES,
    duration = PTZCAL_PROBE_FIGURE_DURATION,
  };
  constexpr probe_figure() noexcept = default;
  constexpr probe_figure(value known) noexcept : number_(known) {}
  explicit constexpr probe_figure(std::uint32_t number) noexcept : number_(number) {}
  constexpr operator std::uint32_t() const noexcept { return number_; }

 private:
  std::uint32_t number_ = 0;
};

struct cloud_noise {
  enum value : std::uint32_t {
    unknown = PTZCAL_CLOUD_NOISE_UNKNOWN,
    deviations = PTZCAL_CLOUD_NOISE_DEVIATIONS,
    covariances = PTZCAL_CLOUD_NOISE_COVARIANCES,
  };
  constexpr cloud_noise() noexcept = default;
  constexpr cloud_noise(value known) noexcept : number_(known) {}
  explicit constexpr cloud_noise(std::uint32_t number) noexcept : number_(number) {}
  constexpr operator std::uint32_t() const noexcept { return number_; }

 private:
  std::uint32_t number_ = 0;
};

struct verdict {
  enum value : std::int32_t {
    unchanged = PTZCAL_VERDICT_UNCHANGED,
    camera_moved = PTZCAL_VERDICT_CAMERA_MOVED,
    rig_moved = PTZCAL_VERDICT_RIG_MOVED,
    cannot_tell = PTZCAL_VERDICT_CANNOT_TELL,
  };
  constexpr verdict() noexcept = default;
  constexpr verdict(value known) noexcept : number_(known) {}
  explicit constexpr verdict(std::int32_t number) noexcept : number_(number) {}
  constexpr operator std::int32_t() const noexcept { return number_; }

 private:
  std::int32_t number_ = 0;
};

struct shot_state {
  enum value : std::int32_t {
    used = PTZCAL_SHOT_STATE_USED,
    not_seen = PTZCAL_SHOT_STATE_NOT_SEEN,
    scene_changed = PTZCAL_SHOT_STATE_SCENE_CHANGED,
    outlier = PTZCAL_SHOT_STATE_OUTLIER,
  };
  constexpr shot_state() noexcept = default;
  constexpr shot_state(value known) noexcept : number_(known) {}
  explicit constexpr shot_state(std::int32_t number) noexcept : number_(number) {}
  constexpr operator std::int32_t() const noexcept { return number_; }

 private:
  std::int32_t number_ = 0;
};

struct rig_parameter {
  enum value : std::uint32_t {
    laser_x0 = PTZCAL_RIG_PARAMETER_LASER_X0,
    laser_y0 = PTZCAL_RIG_PARAMETER_LASER_Y0,
    laser_vx = PTZCAL_RIG_PARAMETER_LASER_VX,
    laser_vy = PTZCAL_RIG_PARAMETER_LASER_VY,
    head_focal = PTZCAL_RIG_PARAMETER_HEAD_FOCAL,
    head_cx = PTZCAL_RIG_PARAMETER_HEAD_CX,
    head_cy = PTZCAL_RIG_PARAMETER_HEAD_CY,
    axis_tilt_y = PTZCAL_RIG_PARAMETER_AXIS_TILT_Y,
    axis_tilt_z = PTZCAL_RIG_PARAMETER_AXIS_TILT_Z,
    axis_pan_x = PTZCAL_RIG_PARAMETER_AXIS_PAN_X,
    axis_pan_z = PTZCAL_RIG_PARAMETER_AXIS_PAN_Z,
    pan_zero = PTZCAL_RIG_PARAMETER_PAN_ZERO,
    pan_scale = PTZCAL_RIG_PARAMETER_PAN_SCALE,
    tilt_zero = PTZCAL_RIG_PARAMETER_TILT_ZERO,
    tilt_scale = PTZCAL_RIG_PARAMETER_TILT_SCALE,
  };
  constexpr rig_parameter() noexcept = default;
  constexpr rig_parameter(value known) noexcept : number_(known) {}
  explicit constexpr rig_parameter(std::uint32_t number) noexcept : number_(number) {}
  constexpr operator std::uint32_t() const noexcept { return number_; }

 private:
  std::uint32_t number_ = 0;
};

struct study_method {
  enum value : std::uint32_t {
    dlt_exact = PTZCAL_STUDY_METHOD_DLT_EXACT,
    dlt_cascade_printed = PTZCAL_STUDY_METHOD_DLT_CASCADE_PRINTED,
    dlt_cascade = PTZCAL_STUDY_METHOD_DLT_CASCADE,
    closed_form = PTZCAL_STUDY_METHOD_CLOSED_FORM,
    joint_ml = PTZCAL_STUDY_METHOD_JOINT_ML,
  };
  constexpr study_method() noexcept = default;
  constexpr study_method(value known) noexcept : number_(known) {}
  explicit constexpr study_method(std::uint32_t number) noexcept : number_(number) {}
  constexpr operator std::uint32_t() const noexcept { return number_; }

 private:
  std::uint32_t number_ = 0;
};

struct study_draws {
  enum value : std::uint32_t {
    common = PTZCAL_STUDY_DRAWS_COMMON,
    independent = PTZCAL_STUDY_DRAWS_INDEPENDENT,
  };
  constexpr study_draws() noexcept = default;
  constexpr study_draws(value known) noexcept : number_(known) {}
  explicit constexpr study_draws(std::uint32_t number) noexcept : number_(number) {}
  constexpr operator std::uint32_t() const noexcept { return number_; }

 private:
  std::uint32_t number_ = 0;
};

struct study_quantity {
  enum value : std::uint32_t {
    position = PTZCAL_STUDY_QUANTITY_POSITION,
    rotation = PTZCAL_STUDY_QUANTITY_ROTATION,
    focal = PTZCAL_STUDY_QUANTITY_FOCAL,
    principal_point = PTZCAL_STUDY_QUANTITY_PRINCIPAL_POINT,
  };
  constexpr study_quantity() noexcept = default;
  constexpr study_quantity(value known) noexcept : number_(known) {}
  explicit constexpr study_quantity(std::uint32_t number) noexcept : number_(number) {}
  constexpr operator std::uint32_t() const noexcept { return number_; }

 private:
  std::uint32_t number_ = 0;
};

struct study_plot {
  enum value : std::uint32_t {
    errors = PTZCAL_STUDY_PLOT_ERRORS,
    grid = PTZCAL_STUDY_PLOT_GRID,
    scatter = PTZCAL_STUDY_PLOT_SCATTER,
  };
  constexpr study_plot() noexcept = default;
  constexpr study_plot(value known) noexcept : number_(known) {}
  explicit constexpr study_plot(std::uint32_t number) noexcept : number_(number) {}
  constexpr operator std::uint32_t() const noexcept { return number_; }

 private:
  std::uint32_t number_ = 0;
};

struct measured_by {
  enum value : std::int32_t {
    others = PTZCAL_MEASURED_BY_OTHERS,
    this_rig = PTZCAL_MEASURED_BY_THIS_RIG,
  };
  constexpr measured_by() noexcept = default;
  constexpr measured_by(value known) noexcept : number_(known) {}
  explicit constexpr measured_by(std::int32_t number) noexcept : number_(number) {}
  constexpr operator std::int32_t() const noexcept { return number_; }

 private:
  std::int32_t number_ = 0;
};

inline constexpr std::uint32_t max_count = PTZCAL_MAX_COUNT;
inline constexpr std::uint32_t max_string = PTZCAL_MAX_STRING;
inline constexpr std::uint32_t sift_keypoint_size = PTZCAL_SIFT_KEYPOINT_SIZE;
inline constexpr std::uint32_t sift_descriptor_size = PTZCAL_SIFT_DESCRIPTOR_SIZE;
inline constexpr std::uint32_t rgbd_pair_size = PTZCAL_RGBD_PAIR_SIZE;
inline constexpr std::uint32_t rgbd_line_size = PTZCAL_RGBD_LINE_SIZE;
inline constexpr std::uint32_t head_camera = PTZCAL_HEAD_CAMERA;
inline constexpr std::uint32_t rig_parameters = PTZCAL_RIG_PARAMETERS;
inline constexpr std::uint32_t no_camera = PTZCAL_NO_CAMERA;
inline constexpr std::uint32_t no_plane = PTZCAL_NO_PLANE;
inline constexpr std::uint32_t label_handoff = PTZCAL_LABEL_HANDOFF;

PTZCAL_END

#endif
