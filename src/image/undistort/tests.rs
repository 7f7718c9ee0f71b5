use std::f64::consts::FRAC_PI_2;

use nalgebra::{Vector2, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::map::{Content, FRACTION_BITS, LARGEST};
use super::*;
use crate::error::Status;
use crate::geometry::Intrinsics;
use crate::geometry::rigid::{exp, rotation_x, rotation_y};
use crate::image::Image;

const LENSES: [Distortion; 7] = [
    Distortion::None,
    Distortion::BrownConrady([-0.28, 0.09, 0.001, -0.002, 0.01]),
    Distortion::BrownConrady([0.15, -0.02, 0.0, 0.0, 0.0]),
    Distortion::Division(-0.2),
    Distortion::Division(0.08),
    Distortion::Fisheye([-0.012, 0.02, -0.017, 0.0035]),
    Distortion::Fisheye([0.0; 4]),
];

fn camera(distortion: Distortion) -> Camera {
    let pose = Rigid { rotation: exp(&Vector3::new(0.05, -0.2, 0.1)), translation: Vector3::new(0.1, -0.05, 0.3) };
    let intrinsics = Intrinsics { fx: 250.0, fy: 248.0, skew: 0.4, cx: 163.0, cy: 117.0 };
    Camera { width: 320, height: 240, intrinsics, distortion, pose }
}

fn ideal(camera: &Camera) -> Camera {
    let k = Intrinsics { skew: 0.0, ..camera.intrinsics };
    Camera { distortion: Distortion::None, intrinsics: k, ..*camera }
}

/// The camera itself without a lens, a view turned and zoomed in, one zoomed out, one rolled, one backwards.
fn views(camera: &Camera) -> Vec<Camera> {
    let plain = ideal(camera);
    let turned = |w: Vector3<f64>, zoom: f64, width: u32, height: u32| {
        let pose = Rigid { rotation: exp(&w) * camera.pose.rotation, translation: Vector3::zeros() };
        let intrinsics = Intrinsics::new(250.0 * zoom, width as f64 / 2.0, height as f64 / 2.0);
        Camera { width, height, intrinsics, pose, ..plain }
    };
    vec![
        plain,
        turned(Vector3::new(0.1, 0.25, 0.0), 3.0, 200, 150),
        turned(Vector3::new(0.0, 0.1, 0.05), 0.25, 301, 77),
        turned(Vector3::new(0.2, 0.0, FRAC_PI_2 - 0.3), 1.0, 130, 260),
        turned(Vector3::new(0.0, 2.0, 0.4), 0.3, 150, 150),
    ]
}

/// Where the map says that a pixel lies; `None`: outside.
fn mapped(undistorter: &Undistorter, x: u32, y: u32) -> Option<Vector2<f64>> {
    let band = &undistorter.bands[(y / LARGEST) as usize];
    let inside = |start: u32, size: u32, at: u32| (start..start + size).contains(&at);
    let mut cells = band.iter().filter(|c| inside(c.x, c.size, x) && inside(c.y, c.size, y));
    let cell = cells.next().expect("every pixel is in a cell");
    assert!(cells.next().is_none(), "two cells at {x}, {y}");
    let (i, j) = ((x - cell.x) as usize, y - cell.y);
    let fixed = match &cell.content {
        Content::Outside => return None,
        Content::Cubic(cubic) => cubic.row(j, cell.size).position(i),
        Content::Exact(positions) => positions[(j * cell.size) as usize + i],
    };
    Some(Vector2::from(fixed.map(|v| f64::from(v) / f64::from(1 << FRACTION_BITS))))
}

/// By Camera's own functions.
fn exact(camera: &Camera, ideal: &Camera, x: u32, y: u32) -> Option<Vector2<f64>> {
    let direction = ideal.back_project(&Vector2::new(x.into(), y.into()))?.direction;
    let d = camera.pose.rotation * direction;
    let limit = camera.distortion.monotone_radius();
    if limit.is_finite() && (d.z <= 0.0 || d.xy().norm() > limit * d.z) {
        return None;
    }
    camera.project_camera_point(&d)
}

/// Its pixel or one of the three beside it is in the image.
fn touches(camera: &Camera, p: &Vector2<f64>) -> bool {
    p.x > -1.0 && p.y > -1.0 && p.x < camera.width.into() && p.y < camera.height.into()
}

#[test]
fn positions_are_those_of_the_camera() {
    for lens in LENSES {
        let camera = camera(lens);
        for view in views(&camera) {
            let undistorter = Undistorter::new(&camera, &view).unwrap();
            let (mut worst, mut seen) = (0.0f64, 0);
            for (x, y) in (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y))) {
                let wanted = exact(&camera, undistorter.camera(), x, y).filter(|p| touches(&camera, p));
                let got = mapped(&undistorter, x, y);
                match wanted {
                    Some(wanted) => {
                        let got = got.unwrap_or_else(|| panic!("{lens:?} {x} {y} is outside, not at {wanted}"));
                        worst = worst.max((got - wanted).norm());
                        seen += 1;
                    }
                    // Nothing of the image is drawn there, but for what the error blends in at its border.
                    None => assert!(got.is_none_or(|p| {
                        let (w, h) = (f64::from(camera.width), f64::from(camera.height));
                        p.x < -0.98 || p.y < -0.98 || p.x > w - 0.02 || p.y > h - 0.02
                    })),
                }
            }
            assert!(worst < 1.0 / 64.0, "{lens:?} {worst}");
            assert!(seen > 0 || view.intrinsics.fx == 75.0, "{lens:?} sees nothing");
        }
    }
}

#[test]
fn a_smooth_lens_takes_few_cells() {
    let hd =
        Camera { width: 1920, height: 1080, intrinsics: Intrinsics::new(1000.0, 960.0, 540.0), ..camera(LENSES[1]) };
    let undistorter = Undistorter::new(&hd, &ideal(&hd)).unwrap();
    let cells = undistorter.bands.iter().flatten().count();
    assert!(cells <= 15 * 9 * 4, "{cells} cells");
}

fn noise(format: PixelFormat, width: u32, height: u32, seed: u64) -> Image {
    let mut image = Image::new(format, width, height);
    ChaCha8Rng::seed_from_u64(seed).fill_bytes(&mut image.data);
    image
}

fn whole(camera: &Camera) -> Region {
    Region { x: 0, y: 0, width: camera.width, height: camera.height }
}

fn apply(undistorter: &Undistorter, image: &ImageView, border: [u8; 4]) -> Image {
    let Camera { width, height, .. } = *undistorter.camera();
    let mut picture = Image::new(image.format(), width, height);
    let row = image.format().row_bytes(0, width).unwrap();
    let mut out = PlaneViewMut::new(&mut picture.data, row as isize, row, height as usize).unwrap();
    undistorter.apply(image, &whole(undistorter.camera()), border, &mut out).unwrap();
    picture
}

const FORMATS: [PixelFormat; 5] =
    [PixelFormat::Gray8, PixelFormat::Rgb24, PixelFormat::Bgr24, PixelFormat::Rgba32, PixelFormat::Bgra32];

#[test]
fn without_a_lens_an_image_stays_as_it_is() {
    let camera = Camera { intrinsics: Intrinsics::new(256.0, 160.0, 120.0), ..camera(Distortion::None) };
    let undistorter = Undistorter::new(&camera, &camera).unwrap();
    for format in FORMATS {
        let image = noise(format, 320, 240, 1);
        let picture = apply(&undistorter, &image.view().unwrap(), [9; 4]);
        let differences = picture.data.iter().zip(&image.data).filter(|(a, b)| a.abs_diff(**b) > 1).count();
        // Rounding of a position by 2^-14 pixels changes a value by 255 / 2^14 at most.
        assert_eq!(differences, 0, "{format:?}");
    }
}

#[test]
fn vectors_and_scalars_give_the_same_bytes() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut below = |n: u32| rng.next_u32() % n;
    for round in 0..60u32 {
        let lens = LENSES[below(7) as usize];
        let (width, height) = (1 + below(if round % 3 == 0 { 40 } else { 300 }), 1 + below(200));
        let k = Intrinsics::new(f64::from(80 + below(300)), f64::from(width) / 2.0, f64::from(height) / 2.0);
        let camera = Camera { width, height, intrinsics: k, ..camera(lens) };
        let turn =
            Vector3::new(f64::from(below(100)) / 400.0, f64::from(below(100)) / 400.0, f64::from(below(100)) / 100.0);
        let turn = if round % 2 == 0 { turn * 0.1 } else { turn };
        let view = Camera {
            width: 1 + below(280),
            height: 1 + below(150),
            intrinsics: Intrinsics { fx: k.fx * f64::from(50 + below(200)) / 100.0, ..k },
            pose: Rigid { rotation: exp(&turn) * camera.pose.rotation, translation: Vector3::zeros() },
            distortion: Distortion::None,
        };
        let undistorter = Undistorter::new(&camera, &view).unwrap();
        let format = FORMATS[below(5) as usize];
        let (row, padding) = (format.row_bytes(0, width).unwrap(), below(20) as usize);
        let mut data = vec![0; (row + padding) * height as usize];
        ChaCha8Rng::seed_from_u64(u64::from(round)).fill_bytes(&mut data);
        let stride = (row + padding) as isize * if below(2) == 0 { 1 } else { -1 };
        let image = ImageView::new(format, width, height, &[(&data, stride)]).unwrap();
        let (x, y) = (below(view.width), below(view.height));
        let region = Region { x, y, width: 1 + below(view.width - x), height: 1 + below(view.height - y) };
        let out_row = format.row_bytes(0, region.width).unwrap();
        let draw = |vectors: bool| {
            let mut memory = vec![77; (out_row + 5) * region.height as usize];
            let out_stride = (out_row + 5) as isize * if round % 5 == 0 { -1 } else { 1 };
            let mut out = PlaneViewMut::new(&mut memory, out_stride, out_row, region.height as usize).unwrap();
            undistorter.apply_with(&image, &region, [1, 2, 3, 4], vectors, &mut out).unwrap();
            memory
        };
        assert_eq!(draw(true), draw(false), "{round}: {format:?} {lens:?} {width} x {height}");
        // The region is that part of the whole.
        let packed = apply(&undistorter, &image.to_image().view().unwrap(), [1, 2, 3, 4]);
        let part = draw(true);
        for j in 0..region.height as usize {
            let at = if round % 5 == 0 { region.height as usize - 1 - j } else { j } * (out_row + 5);
            let start = ((y as usize + j) * view.width as usize + x as usize) * (row / width as usize);
            assert_eq!(part[at..at + out_row], packed.data[start..start + out_row], "{round} row {j}");
            assert_eq!(part[at + out_row..at + out_row + 5], [77; 5], "between the rows");
        }
    }
}

/// A smooth world at infinity: a value for every direction.
fn scene(d: &Vector3<f64>) -> f64 {
    let d = d.normalize();
    127.0 + 60.0 * (7.0 * d.x + 1.0).sin() * (6.0 * d.y).cos() + 50.0 * (5.0 * d.z + 3.0 * d.y).sin()
}

fn rendered(camera: &Camera) -> Image {
    let mut image = Image::new(PixelFormat::Gray8, camera.width, camera.height);
    for (i, value) in image.data.iter_mut().enumerate() {
        let pixel = Vector2::new((i % camera.width as usize) as f64, (i / camera.width as usize) as f64);
        *value = camera.back_project(&pixel).map_or(0, |ray| (scene(&ray.direction) + 0.5) as u8);
    }
    image
}

#[test]
fn pictures_are_those_of_the_ideal_camera() {
    for lens in LENSES {
        let camera = camera(lens);
        let image = rendered(&camera);
        for view in views(&camera) {
            let undistorter = Undistorter::new(&camera, &view).unwrap();
            let picture = apply(&undistorter, &image.view().unwrap(), [0; 4]);
            let mut inside = 0;
            for (x, y) in (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y))) {
                let Some(p) = exact(&camera, undistorter.camera(), x, y) else { continue };
                if p.x < 0.0 || p.y < 0.0 || p.x > 319.0 || p.y > 239.0 {
                    continue;
                }
                inside += 1;
                let ray = undistorter.camera().back_project(&Vector2::new(x.into(), y.into())).unwrap();
                let got = f64::from(picture.data[(y * view.width + x) as usize]);
                // Half a grey level of rounding in the image and in the picture; the rest is the
                // curvature between pixels (about 0.02) and 1/64 pixel of the position (0.05).
                let difference = (got - scene(&ray.direction)).abs();
                assert!(difference < 1.1, "{lens:?} {x} {y}: {difference}");
            }
            assert!(inside > 500 || view.intrinsics.fx == 75.0, "{lens:?}: {inside}");
        }
    }
}

#[test]
fn the_image_of_a_straight_line_becomes_straight() {
    for lens in &LENSES[1..] {
        let camera = camera(*lens);
        // A ridge 1.5 pixels wide about the picture of a line in space: the plane through it and the centre.
        let normal = Vector3::new(0.18, -1.0, 0.30).normalize();
        let mut image = Image::new(PixelFormat::Gray8, 320, 240);
        for (i, value) in image.data.iter_mut().enumerate() {
            let pixel = Vector2::new((i % 320) as f64, (i / 320) as f64);
            let Some(d) = camera.distortion.direction(&camera.intrinsics.to_normalised(&pixel)) else { continue };
            let distance = normal.dot(&d).asin() * 250.0;
            *value = (250.0 * (-distance * distance / (2.0 * 1.5 * 1.5)).exp() + 0.5) as u8;
        }
        let view = undistorted_camera(&camera, 0.0).unwrap();
        let undistorter = Undistorter::new(&camera, &view).unwrap();
        let picture = apply(&undistorter, &image.view().unwrap(), [0; 4]);
        let centroid = |x: usize| {
            let column = (0..240).map(|y| (y as f64, f64::from(picture.data[y * 320 + x])));
            let (sum, moment) = column.fold((0.0, 0.0), |(s, m), (y, v)| (s + v, m + v * y));
            (sum > 300.0).then(|| (x as f64, moment / sum))
        };
        let points: Vec<_> = (20..300).filter_map(centroid).collect();
        assert!(points.len() > 200, "{lens:?}: {}", points.len());
        let n = points.len() as f64;
        let mean = points.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
        let (sxx, sxy) = points
            .iter()
            .fold((0.0, 0.0), |(a, b), (x, y)| (a + (x - mean.0) * (x - mean.0), b + (x - mean.0) * (y - mean.1)));
        let rms = points.iter().map(|(x, y)| (y - mean.1 - (x - mean.0) * sxy / sxx).powi(2)).sum::<f64>() / n;
        assert!(rms.sqrt() < 0.05, "{lens:?}: {}", rms.sqrt());
    }
}

/// Greatest distances by which pixels of the picture leave the image, and of the image the picture.
fn outside(camera: &Camera, view: &Camera) -> [f64; 2] {
    let beyond = |p: Vector2<f64>, c: &Camera| {
        let (w, h) = (f64::from(c.width) - 1.0, f64::from(c.height) - 1.0);
        (-p.x).max(-p.y).max(p.x - w).max(p.y - h)
    };
    let pixels = (0..240).flat_map(|y| (0..320).map(move |x| Vector2::new(f64::from(x), f64::from(y))));
    let mut worst = [f64::NEG_INFINITY; 2];
    for pixel in pixels {
        let there = view.back_project(&pixel).unwrap().direction;
        let p = camera.project_camera_point(&(camera.pose.rotation * there)).unwrap();
        worst[0] = worst[0].max(beyond(p, camera));
        let back = camera.back_project(&pixel).unwrap().direction;
        worst[1] = worst[1].max(beyond(view.project_camera_point(&(view.pose.rotation * back)).unwrap(), view));
    }
    worst
}

#[test]
fn ideal_cameras_fill_their_picture_or_hold_the_image() {
    for lens in LENSES {
        let camera = camera(lens);
        let filled = undistorted_camera(&camera, 0.0).unwrap();
        let all = undistorted_camera(&camera, 1.0).unwrap();
        let between = undistorted_camera(&camera, 0.5).unwrap();
        for ideal in [&filled, &all, &between] {
            assert_eq!((ideal.width, ideal.height, ideal.pose), (320, 240, camera.pose));
            assert_eq!((ideal.distortion, ideal.intrinsics.skew), (Distortion::None, 0.0));
            let ratio = |k: &Intrinsics| k.fx / k.fy;
            assert!((ratio(&ideal.intrinsics) - ratio(&camera.intrinsics)).abs() < 1e-12);
        }
        // Everything inside, and the least bit more of view would not be.
        let [leaves, _] = outside(&camera, &filled);
        assert!((-1e-4..1e-5).contains(&leaves), "{lens:?}: {leaves}");
        let [_, leaves] = outside(&camera, &all);
        assert!((-1e-6..1e-6).contains(&leaves), "{lens:?}: {leaves}");
        assert!(filled.intrinsics.fx > all.intrinsics.fx);
        let middle = (filled.intrinsics.fx + all.intrinsics.fx) / 2.0;
        assert!((between.intrinsics.fx - middle).abs() < 1e-9);
    }
    // Nothing to take out: the camera itself.
    let plain = Camera { intrinsics: Intrinsics::new(250.0, 160.0, 120.0), ..camera(Distortion::None) };
    assert_eq!(undistorted_camera(&plain, 0.3).unwrap(), plain);
}

#[test]
fn lenses_of_180_degrees_are_refused_or_filled() {
    // 125 pixels a radian: the corners of 320 x 240 are at 92 degrees, the sides at 73.
    let dome = Camera { intrinsics: Intrinsics::new(125.0, 159.5, 119.5), ..camera(Distortion::Fisheye([0.0; 4])) };
    let refused = undistorted_camera(&dome, 1.0).unwrap_err();
    assert_eq!(refused.status(), Status::InvalidArgument);
    assert!(refused.to_string().contains("180 degrees"), "{refused}");
    assert!(undistorted_camera(&dome, 0.5).is_err());
    let filled = undistorted_camera(&dome, 0.0).unwrap();
    let undistorter = Undistorter::new(&dome, &filled).unwrap();
    let white = Image { data: vec![255; 320 * 240], ..Image::new(PixelFormat::Gray8, 320, 240) };
    assert!(apply(&undistorter, &white.view().unwrap(), [0; 4]).data.iter().all(|v| *v == 255));
    // The whole border is behind the camera.
    let behind = Camera { intrinsics: Intrinsics::new(60.0, 159.5, 119.5), ..dome };
    assert!(undistorted_camera(&behind, 0.0).is_err());
    // Its middle can still be seen, and turned.
    let side = Camera { pose: Rigid { rotation: rotation_y(-1.2) * dome.pose.rotation, ..dome.pose }, ..ideal(&dome) };
    let undistorter = Undistorter::new(&behind, &side).unwrap();
    assert!(apply(&undistorter, &white.view().unwrap(), [0; 4]).data.iter().filter(|v| **v == 255).count() > 30_000);
}

#[test]
fn a_lens_that_folds_back_shows_nothing_twice() {
    // Grows up to the radius sqrt(1 / (3 * 0.5)) = 0.816, whose image is at 0.544: 136 pixels.
    let camera = camera(Distortion::BrownConrady([-0.5, 0.0, 0.0, 0.0, 0.0]));
    let refused = undistorted_camera(&camera, 1.0).unwrap_err();
    assert_eq!(refused.status(), Status::LensNotMonotone);
    let view = Camera { intrinsics: Intrinsics::new(60.0, 160.0, 120.0), ..ideal(&camera) };
    let undistorter = Undistorter::new(&camera, &view).unwrap();
    let white = Image { data: vec![255; 320 * 240], ..Image::new(PixelFormat::Gray8, 320, 240) };
    let picture = apply(&undistorter, &white.view().unwrap(), [0; 4]);
    for (i, value) in picture.data.iter().enumerate() {
        let radius = ((i % 320) as f64 - 160.0).hypot((i / 320) as f64 - 120.0) / 60.0;
        if !(0.80..0.83).contains(&radius) && radius > 0.83 {
            assert_eq!(*value, 0, "{radius}");
        }
    }
    assert!(picture.data.contains(&255));
}

#[test]
fn what_is_no_camera_image_or_region_is_refused() {
    let camera = camera(LENSES[1]);
    let view = ideal(&camera);
    let status = |c: &Camera, i: &Camera| Undistorter::new(c, i).unwrap_err().status();
    assert_eq!(status(&camera, &camera), Status::InvalidArgument);
    assert_eq!(status(&camera, &Camera { width: 0, ..view }), Status::InvalidArgument);
    assert_eq!(status(&Camera { height: 0, ..camera }, &view), Status::InvalidArgument);
    assert_eq!(status(&camera, &Camera { width: 65536, height: 1025, ..view }), Status::InvalidArgument);
    let nan = Camera { intrinsics: Intrinsics { cx: f64::NAN, ..view.intrinsics }, ..view };
    assert_eq!(status(&camera, &nan), Status::NotFinite);
    for keep in [-0.1, 1.1, f64::INFINITY] {
        assert_eq!(undistorted_camera(&camera, keep).unwrap_err().status(), Status::InvalidArgument);
    }
    assert_eq!(undistorted_camera(&camera, f64::NAN).unwrap_err().status(), Status::NotFinite);
    assert_eq!(undistorted_camera(&nan, 0.0).unwrap_err().status(), Status::NotFinite);
    assert!(undistorted_camera(&Camera { width: 1, ..camera }, 0.0).is_err());

    let undistorter = Undistorter::new(&camera, &view).unwrap();
    let apply = |image: &Image, region: Region, row: usize, rows: usize| {
        let mut memory = vec![0; row * rows];
        let mut out = PlaneViewMut::new(&mut memory, row as isize, row, rows).unwrap();
        undistorter.apply(&image.view().unwrap(), &region, [0; 4], &mut out).map_err(|e| e.status())
    };
    let grey = Image::new(PixelFormat::Gray8, 320, 240);
    let all = whole(&view);
    assert_eq!(apply(&grey, all, 320, 240), Ok(()));
    assert_eq!(apply(&Image::new(PixelFormat::Gray8, 321, 240), all, 320, 240), Err(Status::InvalidArgument));
    for format in [PixelFormat::Yuyv, PixelFormat::Nv12, PixelFormat::I420] {
        assert_eq!(apply(&Image::new(format, 320, 240), all, 320, 240), Err(Status::Unsupported), "{format:?}");
    }
    for (row, rows) in [(319, 240), (320, 239), (960, 240)] {
        assert_eq!(apply(&grey, all, row, rows), Err(Status::InvalidArgument));
    }
    for region in [
        Region { width: 0, ..all },
        Region { height: 0, ..all },
        Region { x: 1, ..all },
        Region { y: u32::MAX, ..all },
        Region { width: u32::MAX, ..all },
    ] {
        assert_eq!(apply(&grey, region, 320, 240), Err(Status::InvalidArgument), "{region:?}");
    }
}

#[test]
fn any_finite_camera_is_mapped_or_refused() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut number = |scale: f64| (f64::from(rng.next_u32()) / f64::from(u32::MAX) - 0.5) * scale;
    for round in 0..40 {
        let scale = [1.0, 1e3, 1e9, 1e300][round % 4];
        let lens = match round % 3 {
            0 => Distortion::BrownConrady(std::array::from_fn(|_| number(scale))),
            1 => Distortion::Division(number(scale)),
            _ => Distortion::Fisheye(std::array::from_fn(|_| number(scale))),
        };
        let k = Intrinsics {
            fx: 1e-3 + number(scale).abs(),
            fy: 1e-3 + number(scale).abs(),
            skew: number(scale),
            cx: number(scale),
            cy: number(scale),
        };
        let camera = Camera { width: 64, height: 48, intrinsics: k, ..camera(lens) };
        let plain = Camera { distortion: Distortion::None, ..camera };
        let turned = Camera { pose: Rigid { rotation: rotation_x(number(6.0)), ..plain.pose }, ..plain };
        let image = noise(PixelFormat::Bgr24, 64, 48, 5);
        for view in [plain, turned] {
            if let Ok(undistorter) = Undistorter::new(&camera, &view) {
                apply(&undistorter, &image.view().unwrap(), [0; 4]);
            }
        }
        for keep in [0.0, 0.5, 1.0] {
            if let Ok(ideal) = undistorted_camera(&camera, keep) {
                Undistorter::new(&camera, &ideal).unwrap();
            }
        }
    }
    // The longest sides there are.
    for (width, height) in [(65536, 2), (2, 65536), (65536, 1)] {
        let k = Intrinsics::new(30_000.0, f64::from(width) / 2.0, f64::from(height) / 2.0);
        let camera = Camera { width, height, intrinsics: k, ..camera(LENSES[1]) };
        let undistorter = Undistorter::new(&camera, &ideal(&camera)).unwrap();
        let image = noise(PixelFormat::Rgba32, width, height, 5);
        apply(&undistorter, &image.view().unwrap(), [0; 4]);
    }
}
