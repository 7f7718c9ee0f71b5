//! Before and while a rig works: how good will the fixed camera be?
//!
//! [`Study`] is the noise study (thesis VII, VIII.D) with the thesis's estimators and the efficient ones;
//! [`PrecisionLabel`] its summary against distance and noise, beside the closed-form covariance; [`plan`]
//! answers before anyone scans how many shots are needed, and where; [`next_shots`] what to shoot next;
//! [`AccuracyWatch`] when to stop. Sections 3, 4, 6 and 8 of docs/maths.md.

pub mod expected;
mod greedy;
pub mod information;
pub mod label;
pub mod method;
mod moments;
pub mod next;
mod normals;
pub mod plan;
mod plots;
mod probe;
pub mod run;
pub mod scene;
pub mod setup;
pub mod statistics;
mod surroundings;
mod tables;
pub mod target;
#[cfg(test)]
mod tests;

pub use expected::{Expected, expected_of};
pub use information::{Accuracy, NoiseLevel};
pub use label::{LabelOptions, LabelRow, PrecisionLabel};
pub use method::Method;
pub use next::{NextOptions, NextShot, NextShots, ScannedShot, next_shots};
pub use plan::{Plan, PlanOptions, plan};
pub use run::{Draws, Study, StudyOptions};
pub use scene::Scene;
pub use setup::{NoiselessShot, SetUp, Site};
pub use statistics::{Cell, Quantity};
pub use target::{AccuracyWatch, SeenShot};
