//! Two stations of the simulated rig, tied by the roof edges that both see.

use ptzcal::geometry::rigid;
use ptzcal::pose::{PlaneFitOptions, PoseMethod, PoseOptions, RoofEdges, estimate_pose_roof_edges, fit_plane_to_shots};
use ptzcal::rig::ScanRegion;
use ptzcal::sim::{SimOptions, Simulator};

use super::{Outcome, open, watch};

/// Pan and tilt ranges, in degrees, of four planes as each station sees them: two that meet in one
/// edge, two that meet in another.
type Patch = [f64; 4];

/// Measured planes and edges of one station.
fn survey(address: &str, patches: &[Patch; 4]) -> Outcome<(Simulator, RoofEdges)> {
    let simulator = Simulator::new(SimOptions::parse(address)?)?;
    let mut rig = open(&simulator)?;
    let mut edges = RoofEdges::new();
    let mut planes = Vec::new();
    for [pan_min, pan_max, tilt_min, tilt_max] in patches {
        let region = ScanRegion {
            pan: [pan_min.to_radians(), pan_max.to_radians()],
            tilt: [tilt_min.to_radians(), tilt_max.to_radians()],
            pan_steps: 10,
            tilt_steps: 10,
        };
        let scan = watch(&mut rig, &simulator, &region, &[])?;
        let shots: Vec<_> = scan.shots.iter().filter_map(|s| s.point.map(|p| p.point)).collect();
        planes.push(edges.add_plane(fit_plane_to_shots(&shots, &PlaneFitOptions::default())?)?);
    }
    edges.add_edge(planes[0], planes[1])?;
    edges.add_edge(planes[2], planes[3])?;
    rig.close()?;
    Ok((simulator, edges))
}

pub fn run() -> Outcome<()> {
    let (_, a) = survey("sim:room?seed=11", &FIRST)?;
    let (simulator, b) = survey("sim:room?seed=12&station=2", &SECOND)?;
    let truth = simulator.truth().station.inverse();
    println!("   {:<28} {:>24} {:>20} {:>14}", "", "position (mm)", "position error", "angle error");
    for (name, method) in [
        ("roof-edge Procrustes", PoseMethod::RoofEdgeProcrustes),
        ("maximum likelihood", PoseMethod::MaximumLikelihood),
    ] {
        let pose = estimate_pose_roof_edges(&a, &b, &PoseOptions { method, ..Default::default() })?;
        let p = pose.position() * 1e3;
        let error = (pose.position() - truth.translation).norm() * 1e3;
        let angle = rigid::log(&(pose.b_to_a.rotation * truth.rotation.transpose())).norm() * 1e3;
        let sigma = (pose.covariance[(3, 3)] + pose.covariance[(4, 4)] + pose.covariance[(5, 5)]).sqrt() * 1e3;
        println!(
            "   {name:<28} {:>24} {error:>6.1} mm (sigma {sigma:.1}) {angle:>9.1} mrad",
            format!("{:.1} {:.1} {:.1}", p.x, p.y, p.z),
        );
    }
    let t = truth.translation * 1e3;
    println!("   {:<28} {:>24}", "truth", format!("{:.1} {:.1} {:.1}", t.x, t.y, t.z));
    Ok(())
}

/// Floor, front of the large box, back wall, right wall, from station 1.
const FIRST: [Patch; 4] =
    [[-40.0, -27.0, -24.0, -21.0], [-20.0, 2.0, -22.0, -8.0], [4.0, 20.0, -8.0, 0.0], [28.0, 50.0, -8.0, 10.0]];

/// The same planes from station 2, 37 degrees further right.
const SECOND: [Patch; 4] =
    [[-50.0, -36.0, -24.0, -21.0], [-28.0, -4.0, -22.0, -13.0], [-44.0, -20.0, -5.0, 0.0], [4.0, 40.0, -6.0, 10.0]];
