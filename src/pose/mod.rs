//! Pose of the rig at one station relative to another, from the planes that both measured, or from
//! roof edges: lines where two planes meet (thesis section V and VIII.B).
//!
//! ```text
//! shots of a region -> plane_fit -> two planes -> roof_edge -> points on edges -> procrustes
//! points, shots or depths -> planes (found) -> stations (which are the same?) -> plane_registration
//! ```

mod consensus;
pub mod estimate;
pub mod line_fit;
pub mod plane_fit;
pub mod plane_registration;
pub mod planes;
pub mod procrustes;
pub mod roof_edge;
pub mod stations;

pub use estimate::{PoseEstimate, PoseMethod, PoseOptions, estimate_pose_roof_edges};
pub use line_fit::{LineEstimate, LineFitOptions, PointNoise, fit_line_3d};
pub use plane_fit::{PlaneEstimate, PlaneFitOptions, fit_plane_to_points, fit_plane_to_shots};
pub use planes::{
    FindPlanesOptions, FoundPlane, PlaneRegion, PlaneSupport, StationPlanes, find_planes_in_points,
    find_planes_in_shots, fit_regions_of_points, fit_regions_of_shots, shots_of_depth_map, shots_of_ranges,
};
pub use procrustes::{ProcrustesFit, procrustes};
pub use roof_edge::{RoofEdge, RoofEdges};
pub use stations::{PosePrior, StationOptions, StationPose, common_roof_edges, register_matched, register_stations};
