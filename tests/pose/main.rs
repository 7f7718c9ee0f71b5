//! Rig pose by roof edges: planes, edges and the relative pose of two stations.

mod plane_fit;
mod random;
mod roof_edges;
