//! The ideal camera that shows what a calibrated one sees: as much as fills its picture, all of it, or
//! something between.

use nalgebra::Vector2;

use super::map::View;
use crate::error::{Error, Result};
use crate::geometry::{Camera, Distortion, Intrinsics};

/// Positions that are out of the image by no more than this, pixels, are rounding.
const ROUNDING: f64 = 1e-6;

/// A camera without a lens at the place of `camera`, of its size, rotation and ratio of focal lengths.
///
/// `keep` is how much of the image's border is kept, as the alpha of OpenCV's
/// `getOptimalNewCameraMatrix`: 0 is the largest view whose pixels are all inside the image, 1 the smallest
/// that holds all pixels of the image, with empty margins; between the two, focal length and principal point go from
/// the one's to the other's.
///
/// # Errors
/// `InvalidArgument` for a camera that is none or has fewer than 2 pixels on a side, `keep` outside
/// 0 to 1, and, unless `keep` is 0, a lens that sees 180 degrees or more; with `keep` 0 one whose
/// picture would be infinite. `LensNotMonotone` for a lens that folds back inside the image (as far as
/// the picture goes, for `keep` 0). `NotFinite` for a `keep` that is NaN.
pub fn undistorted_camera(camera: &Camera, keep: f64) -> Result<Camera> {
    camera.validate()?;
    if keep.is_nan() {
        return Err(Error::NotFinite { name: "keep", index: 0 });
    }
    if !(0.0..=1.0).contains(&keep) {
        return Err(Error::invalid("keep", format!("{keep} is not from 0 to 1")));
    }
    if camera.width < 2 || camera.height < 2 {
        let reason = format!("{} x {} pixels: there is no view between them", camera.width, camera.height);
        return Err(Error::invalid("camera", reason));
    }
    if camera.distortion == Distortion::None && camera.intrinsics.skew == 0.0 {
        return Ok(*camera);
    }
    let full = if keep > 0.0 { Some(outer(camera)?) } else { None };
    let filled = if keep < 1.0 { Some(inner(camera)?) } else { None };
    Ok(match (filled, full) {
        (Some(a), Some(b)) => {
            let (a, b) = (a.intrinsics.to_array(), b.intrinsics.to_array());
            let between = std::array::from_fn(|i| a[i] + (b[i] - a[i]) * keep);
            ideal(camera, Intrinsics::from_array(between))
        }
        (Some(only), None) | (None, Some(only)) => only,
        (None, None) => *camera,
    })
}

fn ideal(camera: &Camera, intrinsics: Intrinsics) -> Camera {
    Camera { intrinsics, distortion: Distortion::None, ..*camera }
}

/// A rectangle of the normalised plane.
struct Rectangle {
    low: Vector2<f64>,
    high: Vector2<f64>,
}

/// The camera whose picture is centred on `centre` (normalised plane), with the focal length `fy`.
fn centred(camera: &Camera, centre: &Vector2<f64>, fy: f64) -> Camera {
    let fx = fy * (camera.intrinsics.fx / camera.intrinsics.fy);
    let [w, h] = spans(camera);
    ideal(camera, Intrinsics { fx, fy, skew: 0.0, cx: w / 2.0 - fx * centre.x, cy: h / 2.0 - fy * centre.y })
}

/// From the centre of the first pixel to that of the last.
fn spans(camera: &Camera) -> [f64; 2] {
    [f64::from(camera.width) - 1.0, f64::from(camera.height) - 1.0]
}

/// The focal lengths fy at which the picture is as wide, and as high, as the rectangle.
fn fitting(camera: &Camera, rectangle: &Rectangle) -> [f64; 2] {
    let [w, h] = spans(camera);
    let size = rectangle.high - rectangle.low;
    [w / size.x * (camera.intrinsics.fy / camera.intrinsics.fx), h / size.y]
}

/// The pixels of a picture's four sides: left, right, top, bottom.
fn sides(camera: &Camera) -> [Box<dyn Iterator<Item = Vector2<f64>>>; 4] {
    let ([w, h], Camera { width, height, .. }) = (spans(camera), *camera);
    [
        Box::new((0..height).map(|y| Vector2::new(0.0, y.into()))),
        Box::new((0..height).map(move |y| Vector2::new(w, y.into()))),
        Box::new((0..width).map(|x| Vector2::new(x.into(), 0.0))),
        Box::new((0..width).map(move |x| Vector2::new(x.into(), h))),
    ]
}

/// Where a pixel is on the normalised plane.
fn undistorted(camera: &Camera, pixel: &Vector2<f64>, limit: f64) -> Result<Vector2<f64>> {
    let k = &camera.intrinsics;
    let folds = || Error::LensNotMonotone { radius_px: (pixel - Vector2::new(k.cx, k.cy)).norm() };
    match camera.distortion.direction(&k.to_normalised(pixel)) {
        Some(d) if d.z > 1e-9 => {
            let p = d.xy() / d.z;
            if p.norm() <= limit { Ok(p) } else { Err(folds()) }
        }
        None if limit.is_finite() => Err(folds()),
        _ => Err(too_wide()),
    }
}

fn too_wide() -> Error {
    let reason =
        "the lens sees 180 degrees or more, which no ideal picture holds: take less, or an ideal camera of your own";
    Error::invalid("keep", reason)
}

/// The smallest view that holds all pixels.
fn outer(camera: &Camera) -> Result<Camera> {
    let limit = camera.distortion.monotone_radius();
    let mut all = Rectangle { low: Vector2::repeat(f64::INFINITY), high: Vector2::repeat(f64::NEG_INFINITY) };
    for pixel in sides(camera).into_iter().flatten() {
        let p = undistorted(camera, &pixel, limit)?;
        all = Rectangle { low: all.low.inf(&p), high: all.high.sup(&p) };
    }
    let [by_width, by_height] = fitting(camera, &all);
    checked(centred(camera, &((all.low + all.high) / 2.0), by_width.min(by_height)))
}

/// The largest view inside the image: the rectangle between the innermost pixels of its four sides,
/// then as much larger or smaller as all its pixels allow.
fn inner(camera: &Camera) -> Result<Camera> {
    let limit = camera.distortion.monotone_radius();
    let [left, right, top, bottom] = sides(camera);
    // A side that is nowhere on the plane does not bound the view.
    let bound = |side: Box<dyn Iterator<Item = Vector2<f64>>>, axis: usize, from: f64, of: fn(f64, f64) -> f64| {
        side.filter_map(|pixel| undistorted(camera, &pixel, limit).ok()).map(|p| p[axis]).fold(from, of)
    };
    let low = Vector2::new(bound(left, 0, f64::NEG_INFINITY, f64::max), bound(top, 1, f64::NEG_INFINITY, f64::max));
    let high = Vector2::new(bound(right, 0, f64::INFINITY, f64::min), bound(bottom, 1, f64::INFINITY, f64::min));
    let rectangle = Rectangle { low, high };
    let centre = ((low + high) / 2.0).map(|c| if c.is_finite() { c } else { 0.0 });
    // A rectangle of endless width does not bound the focal length.
    let [by_width, by_height] = fitting(camera, &rectangle);
    let start = by_width.max(by_height);
    if start == 0.0 {
        return Err(too_wide());
    }
    let view = |fy: f64| centred(camera, &centre, fy);
    let is_inside = |fy: f64| all_inside(camera, &view(fy));
    // The greatest that fails and the least that does not, for as long as doubling finds them.
    let (mut high, mut low) = (start, start);
    let mut steps = 0..60;
    while !is_inside(high) {
        (low, high) = (high, high * 1.5);
        steps.next().ok_or_else(|| Error::invalid("camera", "no view about the middle is inside its image"))?;
    }
    while is_inside(low) {
        (low, high) = (low / 1.5, low);
        steps.next().ok_or_else(too_wide)?;
    }
    while high - low > 1e-9 * high {
        let middle = (low + high) / 2.0;
        if is_inside(middle) { high = middle } else { low = middle }
    }
    checked(view(high))
}

/// Are all pixels of an ideal picture inside the image? Those of its sides tell.
fn all_inside(camera: &Camera, ideal: &Camera) -> bool {
    let (view, [w, h]) = (View::new(camera, ideal), spans(camera));
    let inside = |p: Vector2<f64>| p.x >= -ROUNDING && p.y >= -ROUNDING && p.x <= w + ROUNDING && p.y <= h + ROUNDING;
    sides(ideal).into_iter().flatten().all(|pixel| view.position(pixel.x, pixel.y).is_some_and(inside))
}

/// What came of a lens whose numbers are beyond all measure is refused.
fn checked(ideal: Camera) -> Result<Camera> {
    ideal.validate().map_err(|e| Error::invalid("camera", format!("its lens gives no picture: {e}")))?;
    Ok(ideal)
}
