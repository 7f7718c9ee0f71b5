//! The hot paths on inputs of any size, from fixed seeds: for `growth` (how cost grows) and for the
//! instruction counts of tests/instruction_counts.rs.
#![allow(dead_code)]

use std::ops::ControlFlow::Continue;

use nalgebra::{Matrix2, Vector2, Vector3};
use ptzcal::adjust::{AdjustOptions, Adjustment, CameraSetup, Prior, Shot, Sighting, Station, adjust};
use ptzcal::calibrate::{Boards, CalibrationOptions, calibrate_camera, calibrate_from_boards, dlt};
use ptzcal::detect::chessboard::{ChessboardOptions, detect_chessboard};
use ptzcal::detect::lines::{LineOptions, detect_line_segments};
use ptzcal::detect::sift::{SiftMatchOptions, SiftOptions, detect_sift, match_sift};
use ptzcal::detect::spot::{SpotOptions, detect_spot};
use ptzcal::geometry::{Camera, Distortion, Rigid};
use ptzcal::image::{Image, PixelFormat};
use ptzcal::pose::{FindPlanesOptions, find_planes_in_points};
use ptzcal::rig::ScanRegion;
use ptzcal::study::{Draws, Method, Scene, SetUp, Site, Study, StudyOptions};

use crate::boards as simulated_boards;
use crate::room;
use crate::thesis::{self, Noise};

/// A piece of work, ready to be done again and again.
pub type Work = Box<dyn FnMut()>;

pub struct Task {
    pub name: &'static str,
    /// What its size counts.
    pub of: &'static str,
    pub prepare: fn(usize) -> Work,
    /// Sizes at which its cost is looked at.
    pub sizes: &'static [usize],
    /// A size whose instructions are counted.
    pub counted: usize,
}

const IMAGES: &[usize] = &[320, 640, 1280, 1920, 3840];
const POINTS: &[usize] = &[40, 200, 1000, 5000, 25_000, 100_000];

pub const TASKS: &[Task] = &[
    Task { name: "laser spot, grey", of: "columns of a 16:9 image", prepare: spot, sizes: IMAGES, counted: 640 },
    Task { name: "chessboard found", of: "columns of a 16:9 image", prepare: board, sizes: IMAGES, counted: 640 },
    Task { name: "chessboard absent", of: "columns of a 16:9 image", prepare: no_board, sizes: IMAGES, counted: 640 },
    Task { name: "line segments", of: "columns of a 16:9 image", prepare: lines, sizes: IMAGES, counted: 640 },
    Task { name: "SIFT", of: "columns of a 16:9 image", prepare: sift, sizes: &[320, 640, 1280, 1920], counted: 320 },
    Task {
        name: "SIFT matching",
        of: "features of each image",
        prepare: matching,
        sizes: &[250, 500, 1000, 2000, 4000],
        counted: 500,
    },
    Task { name: "DLT-Points", of: "points", prepare: dlt_points, sizes: POINTS, counted: 2000 },
    Task { name: "calibrate, outliers and covariance", of: "points", prepare: calibrate, sizes: POINTS, counted: 1000 },
    Task { name: "the same, 30 % outliers", of: "points", prepare: robust, sizes: POINTS, counted: 200 },
    Task {
        name: "camera from boards of 54 corners",
        of: "views",
        prepare: views,
        sizes: &[5, 10, 20, 40, 80],
        counted: 10,
    },
    Task {
        name: "adjust rig and camera",
        of: "shots",
        prepare: adjust_shots,
        sizes: &[50, 200, 800, 3200],
        counted: 200,
    },
    Task {
        name: "adjust rig and cameras, 500 shots",
        of: "cameras",
        prepare: adjust_cameras,
        sizes: &[1, 2, 4, 8, 16],
        counted: 3,
    },
    Task {
        name: "planes of a room",
        of: "points",
        prepare: planes,
        sizes: &[1000, 10_000, 100_000, 1_000_000],
        counted: 5000,
    },
    Task {
        name: "noise study, 36 cells x 8 trials x 2021 points",
        of: "threads",
        prepare: study,
        sizes: &[1, 2],
        counted: 1,
    },
    Task {
        name: "project points",
        of: "points",
        prepare: project,
        sizes: &[1000, 10_000, 100_000, 1_000_000],
        counted: 100_000,
    },
];

// ---- images -------------------------------------------------------------------------------------

/// Grey levels at (x, y), with noise of two of them.
fn picture(width: usize, seed: u64, level: impl Fn(f64, f64) -> f64) -> Image {
    let height = width * 9 / 16;
    let mut image = Image::new(PixelFormat::Gray8, width as u32, height as u32);
    // Noise from a table: the normal deviates of a large image would take longer than the work.
    let mut noise = Noise::new(seed);
    let table: Vec<f64> = (0..4096).map(|_| 2.0 * noise.gaussian()).collect();
    let mut place = 0;
    for (i, pixel) in image.data.iter_mut().enumerate() {
        place = (place + 1 + 31 * (i % 7)) % table.len();
        *pixel = (level((i % width) as f64, (i / width) as f64) + table[place]).round().clamp(0.0, 255.0) as u8;
    }
    image
}

fn spot(width: usize) -> Work {
    let w = width as f64;
    let shade = move |x: f64, y: f64| 70.0 + 20.0 * (x / 97.0).sin() * (y / 71.0).cos();
    let bump = move |x: f64, y: f64| 120.0 * (-((x - 0.61 * w).powi(2) + (y - 0.24 * w).powi(2)) / 9.0).exp();
    let (on, off) = (picture(width, 1, move |x, y| shade(x, y) + bump(x, y)), picture(width, 2, shade));
    let options = SpotOptions::default();
    Box::new(move || {
        let (on, off) = (on.view().expect("packed"), off.view().expect("packed"));
        detect_spot(&[on], &[off], &options).expect("a spot");
    })
}

/// A turned board of 9 x 6 corners that fills most of the image.
fn chessboard(width: usize) -> Image {
    let w = width as f64;
    let square = w / 14.0;
    picture(width, 3, move |x, y| {
        let (x, y) = (x - 0.5 * w, y - 0.28 * w);
        let (a, b) = ((0.98 * x + 0.12 * y) / square, (0.98 * y - 0.12 * x) / square);
        let wave = |t: f64| (4.0 * (std::f64::consts::PI * t).sin()).tanh();
        if a.abs() > 5.0 || b.abs() > 3.5 { 190.0 } else { 120.0 + 70.0 * wave(a) * wave(b + 0.5) }
    })
}

fn board(width: usize) -> Work {
    let image = chessboard(width);
    let options = ChessboardOptions { size: Some([9, 6]), ..ChessboardOptions::default() };
    Box::new(move || {
        detect_chessboard(&image.view().expect("packed"), &options).expect("a board");
    })
}

fn no_board(width: usize) -> Work {
    let image = scene(width, 0.0);
    let options = ChessboardOptions { size: Some([9, 6]), ..ChessboardOptions::default() };
    Box::new(move || assert!(detect_chessboard(&image.view().expect("packed"), &options).is_err()))
}

fn lines(width: usize) -> Work {
    let image = chessboard(width);
    Box::new(move || {
        let found = detect_line_segments(&image.view().expect("packed"), &LineOptions::default()).expect("lines");
        assert!(found.len() > 10);
    })
}

/// Blobs of many sizes at random places, as many in a larger image for its area.
fn scene(width: usize, shift: f64) -> Image {
    let (w, h) = (width as f64, width as f64 * 9.0 / 16.0);
    let mut noise = Noise::new(4);
    let mut blob =
        || [noise.uniform() * w, noise.uniform() * h, 1.5 + 5.0 * noise.uniform(), 160.0 * (noise.uniform() - 0.5)];
    let blobs: Vec<[f64; 4]> = (0..width * width / 900).map(|_| blob()).collect();
    let mut levels = vec![128.0; width * (width * 9 / 16)];
    for [x, y, s, peak] in blobs {
        let (x, y) = (x + shift, y + 0.5 * shift);
        let rows = (y - 4.0 * s).max(0.0) as usize..(y + 4.0 * s).clamp(0.0, h - 1.0) as usize;
        for j in rows {
            for i in (x - 4.0 * s).max(0.0) as usize..(x + 4.0 * s).clamp(0.0, w - 1.0) as usize {
                let r2 = (i as f64 - x).powi(2) + (j as f64 - y).powi(2);
                levels[j * width + i] += peak * (-r2 / (2.0 * s * s)).exp();
            }
        }
    }
    picture(width, 5, |x, y| levels[y as usize * width + x as usize])
}

fn sift(width: usize) -> Work {
    let image = scene(width, 0.0);
    Box::new(move || {
        let found = detect_sift(&image.view().expect("packed"), &SiftOptions::default()).expect("features");
        assert!(found.keypoints.len() > 50);
    })
}

fn matching(features: usize) -> Work {
    let options = SiftOptions { max_features: features as u32, ..SiftOptions::default() };
    let width = 1280.min(20 * ((features as f64).sqrt() as usize + 10));
    let [a, b] =
        [0.0, 3.0].map(|shift| detect_sift(&scene(width, shift).view().expect("packed"), &options).expect("features"));
    Box::new(move || {
        let pairs = match_sift(&a, &b, &SiftMatchOptions::default()).expect("matches");
        assert!(pairs.len() > 20);
    })
}

// ---- cameras ------------------------------------------------------------------------------------

/// Points of a room and where NEAR sees them, a share of them elsewhere.
fn seen(n: usize, wrong: f64) -> (Vec<Vector3<f64>>, Vec<Vector2<f64>>) {
    let camera = thesis::near();
    let mut noise = Noise::new(6);
    let mut between = |low: f64, high: f64| low + (high - low) * noise.uniform();
    let world: Vec<_> =
        (0..n).map(|_| Vector3::new(between(-1.2, 1.2), between(-0.9, 0.9), between(1.8, 5.0))).collect();
    let mut noise = Noise::new(7);
    let pixels = world.iter().enumerate().map(|(i, x)| {
        let elsewhere = Vector2::new(800.0 * noise.uniform(), 600.0 * noise.uniform());
        let here = camera.project(x).expect("in front") + noise.pixel(0.5);
        if (i as f64 + 0.5) * wrong % 1.0 < wrong && wrong > 0.0 { elsewhere } else { here }
    });
    let pixels = pixels.collect();
    (world, pixels)
}

fn dlt_points(n: usize) -> Work {
    let (world, pixels) = seen(n, 0.0);
    Box::new(move || {
        dlt::points(&world, &pixels).expect("a camera");
    })
}

fn calibrate(n: usize) -> Work {
    calibration(n, 0.0)
}

fn robust(n: usize) -> Work {
    calibration(n, 0.3)
}

fn calibration(n: usize, wrong: f64) -> Work {
    let (world, pixels) = seen(n, wrong);
    let mut set = ptzcal::calibrate::Correspondences::new(800, 600).expect("a size");
    set.add_points(&world, &pixels).expect("points");
    Box::new(move || {
        calibrate_camera(&set, &CalibrationOptions::default()).expect("a camera");
    })
}

fn views(n: usize) -> Work {
    let lens = Distortion::BrownConrady([-0.2, 0.06, 0.0, 0.0, 0.0]);
    let (camera, grid) = (simulated_boards::head(lens), simulated_boards::grid(9, 6, 0.03));
    let mut noise = Noise::new(8);
    let mut boards = Boards::new(camera.width, camera.height).expect("a size");
    for pose in simulated_boards::poses(n, 0.6, 1.5) {
        boards.add_view(&simulated_boards::corners(&camera, &pose, &grid, 0.2, &mut noise)).expect("a view");
    }
    let options = CalibrationOptions {
        distortion: ptzcal::calibrate::DistortionModel::BrownConrady,
        ..CalibrationOptions::default()
    };
    Box::new(move || {
        calibrate_from_boards(&boards, &options).expect("a camera");
    })
}

fn adjust_shots(n: usize) -> Work {
    adjustment(n, 1)
}

fn adjust_cameras(n: usize) -> Work {
    adjustment(500, n)
}

fn adjustment(shots: usize, cameras: usize) -> Work {
    const SIGMA: f64 = 0.3;
    let rig = thesis::rig();
    let centre = |i: usize| Vector3::new(-0.15 - 0.05 * (i % 4) as f64, 0.05 - 0.04 * (i / 4) as f64, 0.01 * i as f64);
    let turned =
        |i: usize| Camera { pose: Rigid::from_centre(thesis::near().pose.rotation, &centre(i)), ..thesis::near() };
    let truth: Vec<Camera> = (0..cameras).map(turned).collect();
    let mut seen = thesis::grid(&rig, &Rigid::identity(), &truth);
    seen.retain(|s| s.fixed.iter().any(Option::is_some));
    thesis::choose(&mut seen, shots);
    let mut input = Adjustment::new(rig).expect("a rig");
    let mut sigma = nalgebra::DMatrix::zeros(15, 15);
    (0..7).for_each(|i| sigma[(i, i)] = [0.003f64, 0.003, 0.0005, 0.0005, 0.001, 1.0, 1.0][i].powi(2));
    input.set_rig_prior(Prior::of_covariance(sigma)).expect("a prior");
    let station = input.add_station(Station::world()).expect("a station");
    for _ in 0..cameras {
        input.add_camera(CameraSetup::new(800, 600)).expect("a camera");
    }
    let mut noise = Noise::new(9);
    let covariance = Matrix2::identity() * (SIGMA * SIGMA);
    for s in &seen {
        let head = Some((s.head + noise.pixel(SIGMA), covariance));
        let mut sightings = Vec::new();
        for (camera, pixel) in s.fixed.iter().enumerate() {
            sightings.extend(pixel.map(|p| Sighting { camera, pixel: p + noise.pixel(SIGMA), covariance }));
        }
        input.add_shot(Shot { station, pan: s.pan, tilt: s.tilt, head, sightings }).expect("a shot");
    }
    Box::new(move || {
        adjust(&input, &AdjustOptions::default()).expect("a rig and cameras");
    })
}

fn project(n: usize) -> Work {
    let (world, _) = seen(n, 0.0);
    let camera = Camera { distortion: Distortion::BrownConrady([-0.2, 0.06, 0.001, -0.0008, 0.0]), ..thesis::near() };
    Box::new(move || {
        let all = world.iter().filter(|x| camera.project(x).is_some()).count();
        assert_eq!(std::hint::black_box(all), world.len());
    })
}

// ---- rooms --------------------------------------------------------------------------------------

fn planes(n: usize) -> Work {
    let station = Rigid::from_centre(nalgebra::Matrix3::identity(), &Vector3::new(0.2, -0.1, 0.1));
    let scan = room::scan(&room::furnished(), &station, n, 0.01, &mut room::Dice::new(3));
    Box::new(move || {
        let found = find_planes_in_points(&scan.points, Some(0.01), &FindPlanesOptions::default()).expect("planes");
        assert!(found.planes.len() > 5);
    })
}

fn study(threads: usize) -> Work {
    let solid = |[low, high]: [[f64; 3]; 2]| [Vector3::from(low), Vector3::from(high)];
    let scene = Scene::Room { room: solid(thesis::ROOM), boxes: thesis::BOXES.map(solid).to_vec() };
    let degrees = |low: f64, high: f64| [low.to_radians(), high.to_radians()];
    let region = ScanRegion { pan: degrees(-29.0, 25.0), tilt: degrees(-21.0, 19.0), pan_steps: 47, tilt_steps: 43 };
    let set_up = SetUp::from_scene(Site::new(thesis::rig(), thesis::near()), &region, &scene).expect("shots in view");
    let noises = [0.0, 0.2, 0.5, 1.0, 1.5, 2.0];
    let options = StudyOptions {
        methods: vec![Method::DltExact],
        levels: StudyOptions::grid(&noises, &noises),
        trials: 8,
        draws: Draws::Independent,
        threads,
        ..StudyOptions::default()
    };
    Box::new(move || {
        Study::run(&set_up, &options, |_, _| Continue(())).expect("a study");
    })
}
