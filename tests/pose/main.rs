//! Lines, and rig pose by roof edges: planes, edges and the relative pose of two stations.

mod line_fit;
mod plane_fit;
mod random;
mod roof_edges;
