//! Against docs/maths.md, whose figures are those of an independent program in NumPy, and against
//! simulation with known truth.

use std::ops::ControlFlow::{self, Break, Continue};

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::normals::Normals;
use super::*;
use crate::adjust::Prior;
use crate::calibrate::{CalibrationOptions, DistortionModel};
use crate::error::{Error, Status};
use crate::geometry::{Camera, Distortion, Intrinsics, Plane, RigModel, RigParameter, Rigid, rigid};
use crate::rig::ScanRegion;

fn on(_: usize, _: usize) -> ControlFlow<()> {
    Continue(())
}

fn camera(pose: Rigid) -> Camera {
    let intrinsics = Intrinsics { fx: 845.19, fy: 844.56, skew: 0.0, cx: 427.76, cy: 285.53 };
    Camera { width: 800, height: 600, intrinsics, distortion: Distortion::None, pose }
}

fn near() -> Camera {
    let r = Matrix3::new(0.9997, 0.0127, 0.0210, -0.0128, 0.9990, 0.0064, -0.0210, -0.0066, 0.9998);
    let rotation = rigid::nearest_rotation(&r).unwrap();
    camera(Rigid { rotation, translation: Vector3::new(0.15680, -0.04997, -0.01664) })
}

fn far() -> Camera {
    camera(Rigid::look_at(&Vector3::new(-1.6, -0.9, 0.6), &Vector3::new(0.15, 0.15, 2.9)).unwrap())
}

/// The room of docs/maths.md.
fn room() -> Scene {
    let solid = |low: [f64; 3], high: [f64; 3]| [Vector3::from(low), Vector3::from(high)];
    Scene::Room {
        room: solid([-1.9, -1.3, -1.0], [2.0, 1.2, 4.6]),
        boxes: vec![
            solid([-0.7, 0.15, 1.7], [0.2, 1.2, 2.5]),
            solid([-0.48, -0.45, 1.05], [-0.28, 0.1, 1.3]),
            solid([0.25, 0.3, 1.35], [0.5, 1.2, 1.7]),
            solid([-0.9, -0.75, 1.9], [-0.45, -0.1, 2.4]),
            solid([0.1, -0.9, 2.9], [0.9, -0.1, 3.5]),
        ],
    }
}

fn region(pan_steps: u32, tilt_steps: u32) -> ScanRegion {
    let interval = |low: f64, high: f64| [low.to_radians(), high.to_radians()];
    ScanRegion { pan: interval(-29.0, 25.0), tilt: interval(-21.0, 19.0), pan_steps, tilt_steps }
}

/// All eleven parameters free, as in the mathematics notes.
fn site(camera: Camera) -> Site {
    let estimate =
        CalibrationOptions { skew_sigma: f64::INFINITY, aspect_sigma: f64::INFINITY, ..CalibrationOptions::default() };
    Site { estimate, ..Site::new(RigModel::ideal(), camera) }
}

/// `count` shots of the grid of the mathematics notes, which hides nothing from the camera.
fn set_up(camera: Camera, count: usize) -> SetUp {
    let (site, grid) = (site(camera), region(73, 59));
    let scanned: Vec<[f64; 3]> = (0..grid.len())
        .map(|i| {
            let (pan, tilt) = grid.position(i as u32);
            let (o, d) = site.rig.laser_in_world(pan, tilt);
            [pan, tilt, room().depth(&o, &d, i).unwrap()]
        })
        .collect();
    let mut all = SetUp::from_scan(site, &scanned).unwrap();
    let total = all.shots.len();
    all.shots = (0..count.min(total)).map(|i| all.shots[i * total / count.min(total)]).collect();
    all
}

fn level(sigma: f64) -> NoiseLevel {
    NoiseLevel { head: sigma, fixed: sigma }
}

fn options(methods: &[Method], sigmas: &[f64], trials: usize) -> StudyOptions {
    StudyOptions {
        methods: methods.to_vec(),
        levels: sigmas.iter().map(|s| level(*s)).collect(),
        trials,
        threads: 2,
        ..StudyOptions::default()
    }
}

#[test]
fn every_method_errs_as_the_mathematics_notes_say() {
    const TRIALS: usize = 160;
    // Section 3, N = 2021, mean position error in mm at 0.2, 1 and 5 px; a choice of 2021 shots of
    // another kind and 160 trials leave a scatter of about a twentieth, common noise the same at all levels.
    let table = [
        (near(), Method::DltExact, [0.0996, 0.495, 2.47]),
        (near(), Method::DltCascade, [0.291, 5.13, 86.8]),
        (near(), Method::ClosedForm, [0.120, 0.602, 3.19]),
        (near(), Method::JointMl, [0.120, 0.599, 2.98]),
        (far(), Method::DltExact, [0.277, 1.40, 8.74]),
        (far(), Method::DltCascade, [6.23, 127.0, 1140.0]),
        (far(), Method::ClosedForm, [0.984, 4.93, 26.0]),
        (far(), Method::JointMl, [0.984, 4.92, 24.7]),
    ];
    let methods = [Method::DltExact, Method::DltCascade, Method::ClosedForm, Method::JointMl];
    for camera in [near(), far()] {
        let study = Study::run(&set_up(camera, 2021), &options(&methods, &[0.2, 1.0, 5.0], TRIALS), on).unwrap();
        for (_, method, wanted) in table.iter().filter(|(c, ..)| *c == camera) {
            for (cell, wanted) in study.cells_of(*method).iter().zip(wanted) {
                let mean = 1e3 * cell.mean[0];
                assert!((mean / wanted - 1.0).abs() < 0.2, "{method:?} {:?}: {mean} {wanted}", cell.level);
                assert_eq!((cell.used, cell.failures), (TRIALS, 0));
            }
        }
        // Depth noise in the regressor is bias: no number of shots cures the printed method.
        let cascade = &study.cells_of(Method::DltCascade)[1];
        assert!(cascade.bias[0] > 0.9 * cascade.rms[0]);
        let joint = &study.cells_of(Method::JointMl)[1];
        assert!(joint.bias[0] < 0.5 * joint.rms[0]);
    }
}

#[test]
fn maximum_likelihood_scatters_as_its_covariance_says() {
    for (camera, count) in [(near(), 200), (far(), 400)] {
        let study = Study::run(&set_up(camera, count), &options(&[Method::JointMl], &[0.2, 0.5], 300), on).unwrap();
        for (cell, expected) in study.cells.iter().zip(&study.expected) {
            for q in 0..Quantity::COUNT {
                // Two or three components, 300 trials: a standard deviation of 3 to 4 %.
                let ratio = cell.rms[q] / expected.rms[q];
                assert!((ratio - 1.0).abs() < 0.12, "{q}: {ratio}");
            }
            for (simulated, expected) in cell.handoff.iter().zip(&expected.handoff) {
                assert!((simulated / expected - 1.0).abs() < 0.12, "{simulated} {expected}");
            }
        }
    }
}

#[test]
fn an_unsure_rig_and_head_scatter_as_their_covariance_says() {
    let mut sigmas = [0.0; 15];
    for (parameter, sigma) in [
        (RigParameter::LaserX0, 2e-4),
        (RigParameter::LaserVx, 8e-5),
        (RigParameter::HeadFocal, 5e-4),
        (RigParameter::TiltAxisZ, 1e-2),
        (RigParameter::TiltZero, 1e-3),
    ] {
        sigmas[parameter as usize] = sigma;
    }
    let mut set_up = set_up(near(), 150);
    set_up.site.rig_prior = Prior::of_sigmas(&sigmas);
    set_up.site.pointing_sigma = [2e-4, 1e-4];
    let study = Study::run(&set_up, &options(&[Method::JointMl, Method::ClosedForm], &[0.2], 200), on).unwrap();
    let (cell, expected) = (&study.cells[0], &study.expected[0]);
    for q in 0..Quantity::COUNT {
        let ratio = cell.rms[q] / expected.rms[q];
        assert!((ratio - 1.0).abs() < 0.15, "{q}: {ratio}");
    }
    // What takes the rig as exact is worse.
    assert!(study.cells[1].rms[0] > 1.2 * cell.rms[0]);
}

#[test]
fn the_printed_cascade_moves_the_camera_and_nothing_else() {
    let mut set_up = set_up(near(), 100);
    set_up.control = set_up.shots.iter().map(|s| s.point).filter(|x| x.x.abs() < 0.4 * x.z).collect();
    let mut options = options(&[Method::DltExact, Method::DltCascadePrinted], &[], 20);
    options.levels = StudyOptions::grid(&[0.0, 1.0, 2.0], &[0.5]);
    let study = Study::run(&set_up, &options, on).unwrap();
    let (exact, printed) = (study.cells_of(Method::DltExact), study.cells_of(Method::DltCascadePrinted));
    for (exact, printed) in exact.iter().zip(printed) {
        for q in [Quantity::Focal, Quantity::PrincipalPoint] {
            assert!((exact.rms[q as usize] - printed.rms[q as usize]).abs() < 1e-6, "K is not touched");
        }
    }
    assert!((exact[0].rms[0] - printed[0].rms[0]).abs() < 1e-9, "a noiseless head adds nothing");
    assert!(printed[2].rms[0] > printed[1].rms[0] && printed[1].rms[0] > printed[0].rms[0]);
    // Without points for the head camera it cannot be had.
    set_up.control.clear();
    assert_eq!(Study::run(&set_up, &options, on).unwrap_err().status(), Status::InvalidArgument);
}

#[test]
fn threads_change_nothing_and_seeds_everything() {
    let set_up = set_up(near(), 60);
    for draws in [Draws::Common, Draws::Independent] {
        let base = StudyOptions { draws, ..options(&[Method::DltExact, Method::ClosedForm], &[0.0, 0.3, 1.0], 70) };
        let run =
            |threads, seed| Study::run(&set_up, &StudyOptions { threads, seed, ..base.clone() }, on).unwrap().cells;
        let one = run(1, 1);
        assert_eq!(one, run(2, 1));
        assert_eq!(one, run(7, 1));
        let other = run(3, 2);
        assert!(one.iter().zip(&other).all(|(a, b)| a.level.fixed == 0.0 || a.rms != b.rms));
        // Without noise nothing is wrong.
        assert!(one.iter().filter(|c| c.level.fixed == 0.0).all(|c| c.rms[0] < 1e-6));
    }
}

#[test]
fn progress_is_heard_and_can_stop_it() {
    let set_up = set_up(near(), 40);
    let options = options(&[Method::ClosedForm], &[0.2], 50);
    let mut heard = Vec::new();
    Study::run(&set_up, &StudyOptions { threads: 1, ..options.clone() }, |done, total| {
        heard.push((done, total));
        Continue(())
    })
    .unwrap();
    assert_eq!(heard, (1..=50).map(|i| (i, 50)).collect::<Vec<_>>());
    let alone = StudyOptions { threads: 1, ..options.clone() };
    assert_eq!(Study::run(&set_up, &alone, |_, _| Break(())).err(), Some(Error::Cancelled));
    options.cancel.cancel();
    assert_eq!(Study::run(&set_up, &options, on).err(), Some(Error::Cancelled));
}

#[test]
fn bad_studies_are_refused() {
    let set_up = set_up(near(), 40);
    let good = options(&[Method::ClosedForm], &[0.2], 2);
    let refused = |change: &dyn Fn(&mut StudyOptions)| {
        let mut options = good.clone();
        change(&mut options);
        Study::run(&set_up, &options, on).unwrap_err().status()
    };
    for change in [
        &(|o: &mut StudyOptions| o.trials = 0) as &dyn Fn(&mut StudyOptions),
        &|o| o.trials = usize::MAX,
        &|o| o.trials = 100_001,
        &|o| o.methods.clear(),
        &|o| o.methods = vec![Method::JointMl; 2],
        &|o| o.levels.clear(),
        &|o| o.levels = vec![level(-0.1)],
        &|o| o.levels = vec![level(1e9)],
        &|o| o.levels = vec![level(0.1); 10_001],
        &|o| o.threads = 0,
        &|o| o.threads = 1_000_000,
        &|o| o.distances = vec![-1.0],
        &|o| o.distances = vec![1.0; 1001],
        &|o| (o.trials, o.levels) = (100_000, vec![level(0.1); 10_000]),
    ] {
        assert_eq!(refused(change), Status::InvalidArgument);
    }
    assert_eq!(refused(&|o| o.levels = vec![level(f64::NAN)]), Status::NotFinite);
    assert_eq!(refused(&|o| o.distances = vec![f64::INFINITY]), Status::NotFinite);
    // Set-ups.
    let from = |site: Site, scene: Scene| SetUp::from_scene(site, &region(20, 16), &scene).map(|s| s.shots.len());
    let wall = |z| Scene::Plane(Plane { normal: Vector3::z(), distance: z });
    assert!(from(site(near()), wall(3.0)).unwrap() > 100);
    let flat = SetUp::from_scene(site(near()), &region(20, 16), &wall(3.0)).unwrap();
    assert_eq!(Study::run(&flat, &good, on).unwrap_err().status(), Status::Degenerate, "a wall alone");
    assert_eq!(from(site(near()), wall(-3.0)), Err(Error::TooFewPoints { given: 0, needed: 6 }));
    let away = camera(Rigid::look_at(&Vector3::zeros(), &-Vector3::z()).unwrap());
    assert_eq!(from(site(away), room()), Err(Error::TooFewPoints { given: 0, needed: 6 }));
    assert!(from(Site { rig_prior: Prior::fixed(3), ..site(near()) }, room()).is_err());
    assert!(from(Site { pointing_sigma: [-1.0, 0.0], ..site(near()) }, room()).is_err());
    assert!(from(Site { pointing_sigma: [f64::NAN, 0.0], ..site(near()) }, room()).is_err());
    let mut other = site(near());
    other.estimate.distortion = DistortionModel::Division;
    assert!(from(other, room()).is_err());
    let scan = |shot: [f64; 3]| SetUp::from_scan(site(near()), &[shot; 10]).unwrap_err().status();
    assert_eq!(scan([0.0, f64::NAN, 1.0]), Status::NotFinite);
    assert_eq!(scan([0.0, 0.0, -1.0]), Status::InvalidArgument);
    assert_eq!(scan([2.0, 0.0, 1.0]), Status::TooFewPoints);
    let points = |x: Vector3<f64>| SetUp::from_points(site(near()), &[x; 10]).unwrap_err().status();
    assert_eq!(points(Vector3::repeat(f64::NAN)), Status::NotFinite);
    assert_eq!(points(Vector3::new(0.0, 0.0, -2.0)), Status::TooFewPoints);
}

#[test]
fn points_give_the_same_set_up_as_the_shots_that_hit_them() {
    let shots = set_up(far(), 200);
    let points: Vec<_> = shots.shots.iter().map(|s| s.point).collect();
    let again = SetUp::from_points(shots.site.clone(), &points).unwrap();
    assert_eq!(again.shots.len(), shots.shots.len());
    for (a, b) in again.shots.iter().zip(&shots.shots) {
        assert!((a.pan - b.pan).abs() < 1e-9 && (a.tilt - b.tilt).abs() < 1e-9 && (a.depth - b.depth).abs() < 1e-8);
    }
}

#[test]
fn a_label_grows_with_noise_and_shrinks_with_depth() {
    let options = LabelOptions {
        distances: vec![0.5, 2.0, 3.0, 5.0],
        levels: vec![level(0.2), level(1.0)],
        trials: 60,
        threads: 2,
        ..LabelOptions::default()
    };
    let label = PrecisionLabel::make(&set_up(near(), 400), &options, on).unwrap();
    // Nothing is nearer than a metre.
    assert_eq!(label.rows.len(), 6);
    assert!(label.rows.iter().all(|r| r.distance >= 2.0 && r.failures == 0));
    for pair in label.rows.chunks(2) {
        for q in 0..Quantity::COUNT {
            assert!((pair[1].expected[q] / pair[0].expected[q] - 5.0).abs() < 0.05, "linear in the noise");
            assert!((pair[0].simulated[q] / pair[0].expected[q] - 1.0).abs() < 0.25);
        }
        assert!((pair[0].handoff_simulated / pair[0].handoff_expected - 1.0).abs() < 0.25);
    }
    let at = |distance: f64| label.rows.iter().find(|r| r.distance == distance).unwrap();
    assert!(at(2.0).expected[0] > at(3.0).expected[0] && at(3.0).expected[0] > at(5.0).expected[0]);
    // Refused where nothing can be labelled.
    let refused =
        |options: LabelOptions| PrecisionLabel::make(&set_up(near(), 400), &options, on).unwrap_err().status();
    assert_eq!(refused(LabelOptions { distances: vec![0.5], ..options.clone() }), Status::TooFewPoints);
    assert_eq!(refused(LabelOptions { distances: vec![], ..options.clone() }), Status::InvalidArgument);
    assert_eq!(refused(LabelOptions { distances: vec![f64::NAN], ..options.clone() }), Status::NotFinite);
    assert_eq!(refused(LabelOptions { trials: 0, ..options.clone() }), Status::InvalidArgument);
    assert_eq!(refused(LabelOptions { levels: vec![], ..options.clone() }), Status::InvalidArgument);
    assert_eq!(refused(LabelOptions { threads: 0, ..options }), Status::InvalidArgument);
}

#[test]
fn tables_and_charts_hold_every_cell() {
    let mut options = options(&[Method::DltExact, Method::JointMl], &[], 5);
    options.levels = StudyOptions::grid(&[0.2, 1.0], &[0.2, 1.0]);
    let study = Study::run(&set_up(near(), 60), &options, on).unwrap();
    let csv = study.to_csv();
    assert_eq!(csv.lines().count(), 1 + 8);
    let columns = |l: &str| l.replace("DLT, exact", "DLT exact").split(',').count();
    assert!(csv.lines().all(|l| columns(l) == 5 + 16 + 5), "{csv}");
    let json: serde_json::Value = serde_json::from_str(&study.to_json()).unwrap();
    assert_eq!(json["cells"].as_array().unwrap().len(), 8);
    assert_eq!(json["cells"][0]["rms"][0].as_f64().unwrap(), study.cells[0].rms[0]);
    for q in Quantity::ALL {
        assert!(study.plot_errors(q).contains("joint ML"));
    }
    let grid = study.plot_grid(Method::JointMl).unwrap();
    assert_eq!(grid.matches("<rect").count(), 2 + 4);
    let scatter = study.plot_scatter(3).unwrap();
    assert_eq!(scatter.matches("<circle").count(), 2 * (5 + 1));
    assert!(study.plot_grid(Method::ClosedForm).is_err() && study.plot_scatter(4).is_err());
    let label = LabelOptions { trials: 5, ..LabelOptions::default() };
    let label = PrecisionLabel::make(&set_up(near(), 60), &label, on).unwrap();
    assert_eq!(label.to_csv().lines().count(), 1 + label.rows.len());
    let json: serde_json::Value = serde_json::from_str(&label.to_json()).unwrap();
    assert_eq!(json["rows"].as_array().unwrap().len(), label.rows.len());
    assert!(label.plot(Quantity::Centre).contains("working distance (m)") && label.plot_handoff().contains("<svg"));
}

fn plan_options(target: f64) -> PlanOptions {
    let ScanRegion { pan, tilt, .. } = region(1, 1);
    PlanOptions {
        pan,
        tilt,
        scene: room(),
        level: level(0.2),
        target,
        max_positions: 20_000,
        cancel: Default::default(),
    }
}

#[test]
fn a_plan_is_kept_by_simulation() {
    for (camera, target) in [(near(), 0.001), (far(), 0.01)] {
        let site = site(camera);
        let plan = plan(&site, &plan_options(target)).unwrap();
        assert!(plan.grid_accuracy.rms <= target && plan.shots.last().unwrap().after.rms <= target);
        assert!(plan.shots.len() < plan.grid_seen && plan.grid_seen <= plan.grid.len());
        assert!(plan.limit.rms < 0.01 * target && plan.limited_by.is_none(), "the rig is known");
        let grid = SetUp::from_scene(site.clone(), &plan.grid, &room()).unwrap();
        let chosen: Vec<_> = plan.shots.iter().map(|s| [s.pan, s.tilt, s.depth]).collect();
        let chosen = SetUp::from_scan(site.clone(), &chosen).unwrap();
        for set_up in [grid, chosen] {
            let study = Study::run(&set_up, &options(&[Method::JointMl], &[0.2], 200), on).unwrap();
            // Few shots and much noise: first-order covariances are up to a fifth too small.
            assert!(study.cells[0].rms[0] < 1.25 * target, "{} {}", study.cells[0].rms[0], set_up.shots.len());
        }
    }
}

#[test]
fn plans_that_cannot_be_kept_are_refused_with_the_reason() {
    let refused = |site: &Site, options: PlanOptions| plan(site, &options).expect_err("refused");
    let mut unsure = site(near());
    let mut sigmas = [0.0; 15];
    // Both, or the other one would give the scale away.
    sigmas[RigParameter::LaserX0 as usize] = 5e-3;
    sigmas[RigParameter::LaserY0 as usize] = 5e-3;
    unsure.rig_prior = Prior::of_sigmas(&sigmas);
    let why = refused(&unsure, plan_options(1e-3)).to_string();
    assert!(why.contains("any number of shots") && why.contains("laser x0"), "{why}");
    let why = refused(&site(near()), PlanOptions { max_positions: 100, ..plan_options(1e-4) }).to_string();
    assert!(why.contains("positions") && why.contains("allow more"), "{why}");
    let wall = Scene::Plane(Plane { normal: Vector3::z(), distance: 3.0 });
    let flat = refused(&site(near()), PlanOptions { scene: wall.clone(), ..plan_options(0.01) });
    assert_eq!(flat.status(), Status::Degenerate, "{flat}");
    // With the lens given a wall is enough.
    let mut known = site(near());
    known.estimate.fixed_lens = Some((known.camera.intrinsics, known.camera.distortion));
    assert!(plan(&known, &PlanOptions { scene: wall, ..plan_options(0.01) }).is_ok());
    let away = camera(Rigid::look_at(&Vector3::zeros(), &-Vector3::z()).unwrap());
    assert_eq!(refused(&site(away), plan_options(0.01)).status(), Status::NotFound);
    for (options, status) in [
        (plan_options(0.0), Status::InvalidArgument),
        (plan_options(-1.0), Status::InvalidArgument),
        (plan_options(f64::NAN), Status::InvalidArgument),
        (PlanOptions { max_positions: 0, ..plan_options(0.01) }, Status::InvalidArgument),
        (PlanOptions { max_positions: u32::MAX, ..plan_options(0.01) }, Status::InvalidArgument),
        (PlanOptions { level: level(0.0), ..plan_options(0.01) }, Status::InvalidArgument),
        (PlanOptions { level: level(f64::NAN), ..plan_options(0.01) }, Status::NotFinite),
        (PlanOptions { pan: [1.0, 0.0], ..plan_options(0.01) }, Status::InvalidArgument),
        (PlanOptions { tilt: [f64::NAN, 0.0], ..plan_options(0.01) }, Status::NotFinite),
    ] {
        assert_eq!(refused(&site(near()), options).status(), status);
    }
    let cancelled = plan_options(0.01);
    cancelled.cancel.cancel();
    assert_eq!(refused(&site(near()), cancelled), Error::Cancelled);
}

/// What the rig finds at a position, and whether the camera sees it.
fn fire(site: &Site, pan: f64, tilt: f64) -> ScannedShot {
    let (o, d) = site.rig.laser_in_world(pan, tilt);
    let depth = room().depth(&o, &d, 0).unwrap();
    let hidden = |s: NoiselessShot| room().hides(&site.camera.centre(), &s.point);
    let seen = site.shot(pan, tilt, depth).is_some_and(|s| !hidden(s));
    ScannedShot { pan, tilt, depth, seen }
}

fn simulated(site: &Site, scanned: &[ScannedShot]) -> f64 {
    let seen: Vec<_> = scanned.iter().filter(|s| s.seen).map(|s| [s.pan, s.tilt, s.depth]).collect();
    let set_up = SetUp::from_scan(site.clone(), &seen).unwrap();
    Study::run(&set_up, &options(&[Method::JointMl], &[0.2], 150), on).unwrap().cells[0].rms[0]
}

#[test]
fn chosen_shots_are_worth_several_of_a_grid() {
    for camera in [near(), far()] {
        let site = site(camera);
        let grid = |columns, rows| -> Vec<ScannedShot> {
            let region = region(columns, rows);
            (0..region.len() as u32).map(|i| region.position(i)).map(|(p, t)| fire(&site, p, t)).collect()
        };
        let mut scanned = grid(10, 7);
        for _ in 0..6 {
            let options = NextOptions { candidates: region(73, 59), level: level(0.2), count: 20, target: 0.0 };
            let next = next_shots(&site, &scanned, &options).unwrap();
            assert_eq!(next.shots.len(), 20);
            assert!(next.shots[0].after.rms < next.now.rms);
            assert!(next.shots.windows(2).all(|w| w[1].after.rms < w[0].after.rms));
            scanned.extend(next.shots.iter().map(|s| fire(&site, s.pan, s.tilt)));
        }
        // 190 positions against 570.
        let (chosen, even) = (simulated(&site, &scanned), simulated(&site, &grid(26, 22)));
        assert!(chosen < even, "{chosen} {even}");
        // It stops at a target.
        let options = NextOptions { candidates: region(73, 59), level: level(0.2), count: 1000, target: 0.9 * chosen };
        let next = next_shots(&site, &scanned, &options).unwrap();
        assert!(next.shots.len() < 1000 && next.shots.last().unwrap().after.rms <= 0.9 * chosen);
    }
}

/// With every position scanned, nothing is left but to repeat the best of them: greedy choice comes close to
/// the best design, which spends all its shots on a few.
#[test]
fn seen_shots_are_repeated_and_unseen_ones_are_not() {
    let site = site(near());
    let region = region(16, 14);
    let scanned: Vec<_> =
        (0..region.len() as u32).map(|i| region.position(i)).map(|(p, t)| fire(&site, p, t)).collect();
    let options = NextOptions { candidates: region, level: level(0.2), count: 300, target: 0.0 };
    let next = next_shots(&site, &scanned, &options).unwrap();
    assert_eq!(next.shots.len(), 300);
    let mut places: Vec<_> = next.shots.iter().map(|s| [s.pan, s.tilt]).collect();
    places.sort_by(|a, b| a.partial_cmp(b).unwrap());
    places.dedup();
    assert!(places.len() < 40, "{}", places.len());
    // Their depths are the measured ones, and each was seen.
    let was_seen =
        |s: &NextShot| scanned.iter().any(|w| w.seen && [w.pan, w.tilt, w.depth] == [s.pan, s.tilt, s.depth]);
    assert!(next.shots.iter().filter(|s| !was_seen(s)).count() < 10);
    // Repeated shots are worth what they are said to be worth.
    let all: Vec<_> = scanned.iter().copied().chain(next.shots.iter().map(|s| fire(&site, s.pan, s.tilt))).collect();
    let found = simulated(&site, &all);
    let said = next.shots.last().unwrap().after.rms;
    assert!((found / said - 1.0).abs() < 0.2, "{found} {said}");
}

/// Few places are known, and many shots are left: unknown ones come first, and none that was not seen.
#[test]
fn with_a_target_far_off_unknown_places_are_looked_at() {
    let site = site(far());
    let region = region(16, 14);
    let grid = ScanRegion { pan_steps: 7, tilt_steps: 6, ..region };
    let mut scanned: Vec<_> =
        (0..grid.len() as u32).map(|i| grid.position(i)).map(|(p, t)| fire(&site, p, t)).collect();
    let ask = |scanned: &[ScannedShot], target| {
        let options = NextOptions { candidates: region, level: level(0.2), count: 2, target };
        next_shots(&site, scanned, &options).unwrap()
    };
    let target = 0.1 * ask(&scanned, 0.0).now.rms;
    let at = |s: &ScannedShot, n: &NextShot| [s.pan, s.tilt] == [n.pan, n.tilt];
    for _ in 0..5 {
        let next = ask(&scanned, target);
        assert_eq!(next, ask(&scanned, target));
        assert_eq!(next.shots.len(), 2);
        assert!(next.shots[1].after.rms < next.shots[0].after.rms && next.shots[0].after.rms < next.now.rms);
        assert!(!scanned.iter().any(|s| at(s, &next.shots[0])));
        assert!(!scanned.iter().any(|s| !s.seen && at(s, &next.shots[1])));
        scanned.push(fire(&site, next.shots[0].pan, next.shots[0].tilt));
    }
}

#[test]
fn without_scanned_shots_in_view_the_first_ones_are_spread() {
    let site = site(near());
    // One look at the wall: a depth to begin with.
    let scanned = [ScannedShot { seen: false, ..fire(&site, 0.1, 0.0) }];
    let options = NextOptions { candidates: region(20, 16), level: level(0.2), count: 12, target: 0.0 };
    let out_of_view = ScannedShot { pan: 1.0, ..scanned[0] };
    let next = next_shots(&site, &[out_of_view], &options).unwrap();
    assert!(next.now.rms.is_infinite());
    let spread = |of: fn(&NextShot) -> f64| {
        let values = next.shots.iter().map(of);
        values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
    };
    assert!(spread(|s| s.pan) > 0.5 && spread(|s| s.tilt) > 0.35);
    // Hidden in view, and nothing else known: not worth a shot.
    assert_eq!(next_shots(&site, &scanned, &options).map_err(|e| e.status()).err(), Some(Status::NotFound));
    let refused = |scanned: &[ScannedShot], change: &dyn Fn(&mut NextOptions)| {
        let mut options = options.clone();
        change(&mut options);
        next_shots(&site, scanned, &options).unwrap_err().status()
    };
    assert_eq!(refused(&[], &|_| ()), Status::TooFewPoints);
    assert_eq!(refused(&[ScannedShot { depth: f64::NAN, ..scanned[0] }], &|_| ()), Status::NotFinite);
    assert_eq!(refused(&[ScannedShot { depth: 0.0, ..scanned[0] }], &|_| ()), Status::InvalidArgument);
    assert_eq!(refused(&scanned, &|o| o.count = 0), Status::InvalidArgument);
    assert_eq!(refused(&scanned, &|o| o.target = f64::NAN), Status::InvalidArgument);
    assert_eq!(refused(&scanned, &|o| o.level.head = 0.0), Status::InvalidArgument);
    assert_eq!(refused(&scanned, &|o| o.candidates.pan_steps = 0), Status::InvalidArgument);
    assert_eq!(refused(&scanned, &|o| o.candidates = region(1000, 1000)), Status::InvalidArgument);
}

#[test]
fn the_watch_says_when_the_target_is_met() {
    let site = site(near());
    let shots = set_up(near(), 1000).shots;
    let noise = Normals::new(5, 0).pairs(2 * shots.len());
    let covariance = Matrix2::identity() * 0.04;
    let seen: Vec<SeenShot> = shots
        .iter()
        .zip(noise.chunks(2))
        .map(|(s, n)| SeenShot {
            pan: s.pan,
            tilt: s.tilt,
            head: (s.head + Vector2::from(n[0]) * 0.2, covariance),
            fixed: (s.fixed + Vector2::from(n[1]) * 0.2, covariance),
        })
        .collect();
    // An order without system.
    let mixed: Vec<SeenShot> = (0..seen.len()).map(|i| seen[i * 373 % seen.len()]).collect();
    let mut watch = AccuracyWatch::new(RigModel::ideal(), 800, 600, 5e-4).unwrap();
    watch.estimate = site.estimate.clone();
    let fresh = watch.clone();
    let mut shots = mixed.iter();
    let accuracy = shots
        .find_map(|shot| {
            watch.add(*shot);
            watch.reached().unwrap()
        })
        .expect("met at last");
    let met = watch.count();
    assert!(accuracy.rms <= 5e-4 && (20..400).contains(&met), "{met}");
    let truth = expected_of(&site, &set_up(near(), met).shots, &level(0.2), &[]).unwrap();
    assert!((accuracy.rms / truth.position.rms - 1.0).abs() < 0.5, "{} {}", accuracy.rms, truth.position.rms);
    // What is not known of the rig keeps the target away.
    let mut sigmas = [0.0; 15];
    // Both, or the other one would give the scale away.
    sigmas[RigParameter::LaserX0 as usize] = 5e-3;
    sigmas[RigParameter::LaserY0 as usize] = 5e-3;
    shots.for_each(|shot| watch.add(*shot));
    assert_eq!(watch.count(), mixed.len());
    watch.rig_prior = Prior::of_sigmas(&sigmas);
    assert!(watch.accuracy().unwrap().rms > 1e-3);
    // The same shots again are the same answer.
    watch = fresh;
    mixed[..met].iter().for_each(|shot| watch.add(*shot));
    assert_eq!(watch.accuracy().unwrap(), accuracy);
    watch.clear();
    assert!(watch.count() == 0 && watch.accuracy().is_err());
    for target in [0.0, -1.0, f64::NAN] {
        assert!(AccuracyWatch::new(RigModel::ideal(), 800, 600, target).is_err());
    }
    assert!(AccuracyWatch::new(RigModel::ideal(), 0, 600, 1.0).is_err());
}
