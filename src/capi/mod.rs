//! The C API: translates and checks, computes nothing.
//!
//! Everything C can see is here, written out in full so that cbindgen sees it; include/ptzcal.h is
//! made from these files in the order of tests/c_api/header.rs, and their comments are its text: the
//! module's comment is the chapter's heading, and preface.h has the rules that hold for all.
//!
//! How an export is made (camera.rs is the shortest whole example):
//! 1. `ErrorOut::new(error)` clears the caller's error pointer, `guard` runs the body, catches
//!    panics and turns an [`Error`](crate::Error) into a status and an error object.
//! 2. The body first takes every pointer through `args`, `handle` or `sized`, in one `unsafe` block:
//!    handles out first (they are set to NULL on entry), then inputs, then outputs.
//! 3. Then safe code only; outputs are written last, so that a failure leaves them untouched.
//!
//! Every function's comment has its @param lines (those that may be NULL say "may be NULL", in these
//! words), @return, "Threads: free|shared|exclusive." and "Since x.y.z." lines: tests read them, and
//! call every function with every bad argument accordingly (tests/c_api/hostile.rs).
#![allow(unsafe_code)]
// The comments are the text of a C header.
#![allow(rustdoc::broken_intra_doc_links)]
// C's names are C's.
#![allow(non_camel_case_types)]
// Every pointer obeys the rules at the top of the header; they are not repeated on each function.
#![allow(clippy::missing_safety_doc)]

mod call;
mod handle;
mod sized;

pub mod adjust;
pub mod adjusted;
pub mod adjusted_check;
pub mod adjusted_points;
pub mod adjustment;
pub mod adjustment_planes;
pub mod adjustment_shots;
pub mod angle_learning;
pub mod angle_map;
pub mod args;
pub mod boards;
pub mod calibrate;
pub mod calibration_check;
pub mod calibration_options;
pub mod camera;
pub mod camera_list;
pub mod cancel;
pub mod chessboard;
pub mod cloud;
pub mod cloud_data;
pub mod correspondences;
pub mod depth;
pub mod detect;
pub mod devices;
pub mod error;
pub mod explore;
pub mod file;
pub mod head;
pub mod head_control;
pub mod head_options;
pub mod health;
pub mod image;
pub mod label;
pub mod laser_line;
pub mod linear_methods;
pub mod lines;
pub mod lines_3d;
pub mod locating;
pub mod log;
pub mod mesh;
pub mod network;
pub mod picture;
pub mod plan;
pub mod plane_regions;
pub mod planes;
pub mod pointing;
pub mod pose;
pub mod probe;
pub mod progress;
pub mod registration;
pub mod report;
pub mod rgbd;
pub mod rig;
pub mod rig_calibrated;
pub mod rig_calibration;
pub mod rig_model;
pub mod rig_options;
pub mod rig_views;
pub mod roof_edges;
pub mod scan;
pub mod scan_options;
pub mod scan_planes;
pub mod set_up;
pub mod shot;
pub mod sift;
pub mod sift_matching;
pub mod simulator;
pub mod site;
pub mod spot_detector;
pub mod status;
pub mod study;
pub mod sweep;
pub mod uncertainty;
pub mod undistort;
pub mod version;
pub mod zoom_curve;
