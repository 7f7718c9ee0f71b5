//! Before and while a rig works: how good will the fixed camera be? (thesis VII, VIII.D; docs/maths.md
//! sections 3, 4, 6 and 8)
pub mod expected;
pub mod information;
pub mod method;
pub mod moments;
pub mod normals;
pub mod run;
pub mod scene;
pub mod setup;
pub mod statistics;
