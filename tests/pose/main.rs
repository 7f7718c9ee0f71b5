//! Lines, planes, and rig poses by roof edges and by planes.

#[path = "../support/data.rs"]
mod data;
mod line_fit;
#[path = "../support/pcd.rs"]
mod pcd;
mod plane_fit;
mod planes;
mod random;
mod roof_edges;
#[path = "../support/room.rs"]
mod room;
mod sparse_stations;
mod stations;
