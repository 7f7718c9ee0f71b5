//! Clouds
//!
//! Coloured points of the world, with what is known of their noise: from a scan, from a depth map, from
//! a file, or added one list after the other. Clouds of several stations are moved into one frame and
//! merged; clouds that are too fine are thinned. At most 50,000,000 points.

use nalgebra::{SMatrix, Vector3};

use super::args::{Out, array, number, vectors, vectors_optional};
use super::call::{ErrorOut, guard, guard_or};
use super::camera::{camera_in, ptzcal_camera};
use super::depth::ptzcal_depth_map;
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::image::{ptzcal_image, view};
use super::pose::{pose_in, ptzcal_pose};
use super::scan::ptzcal_scan;
use super::status::ptzcal_status;
use crate::cloud::{CloudNoise, PointCloud, RayGrid, crop, depth_grid, grid_cloud, merge, thin, transform};
use crate::error::Result;
use crate::image::DepthNoise;

/// Points of the world.
pub struct ptzcal_cloud(pub(super) Exclusive<PointCloud>);

impl Handle for ptzcal_cloud {
    const NAME: &'static str = "cloud";
}

impl From<PointCloud> for ptzcal_cloud {
    fn from(cloud: PointCloud) -> Self {
        Self(Exclusive::new(cloud))
    }
}

/// What is known of the noise of a cloud's points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ptzcal_cloud_noise {
    Unknown = 0,
    /// The root mean square distance of each point from its truth.
    Deviations = 1,
    /// The covariance of each point.
    Covariances = 2,
}

/// The rays of a depth map's pixels.
///
/// # Safety
/// `image` is NULL or as for [`view`]; the others are NULL, or live, or as long as they say.
pub(super) unsafe fn depth_rays(
    map: *const ptzcal_depth_map,
    camera: *const ptzcal_camera,
    image: *const ptzcal_image,
    [inverse_depth_sigma, depth_sigma]: [f64; 2],
) -> Result<RayGrid> {
    // SAFETY: by this function's contract.
    let (map, camera, image) =
        unsafe { (borrow(map)?, camera_in(camera)?, if image.is_null() { None } else { Some(view(image)?) }) };
    let noise = DepthNoise {
        inverse_depth: number(inverse_depth_sigma, "inverse_depth_sigma")?,
        depth: number(depth_sigma, "depth_sigma")?,
    };
    depth_grid(&map.0, &camera, image.as_ref(), &noise)
}

/// Makes a cloud without points.
///
/// @param cloud Receives the cloud; free it with ptzcal_cloud_free.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_new(
    cloud: *mut *mut ptzcal_cloud,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let cloud = unsafe { HandleOut::new(cloud)? };
        cloud.give(PointCloud::default().into());
        Ok(())
    })
}

/// The points that a scan measured with its head camera, with colours and covariances, which are those
/// of the spots' noise: rank one, along the laser's line.
///
/// @param scan  The scan.
/// @param cloud Receives the cloud; free it with ptzcal_cloud_free.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_from_scan(
    scan: *const ptzcal_scan,
    cloud: *mut *mut ptzcal_cloud,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (cloud, scan) = unsafe { (HandleOut::new(cloud)?, borrow(scan)?) };
        cloud.give(scan.0.cloud().into());
        Ok(())
    })
}

/// The points of a depth map's pixels, in the world of its camera's pose, with covariances.
///
/// @param map                 The map.
/// @param camera              Its camera, of the same size.
/// @param image               The camera's picture, of the same size, for the colours; may be NULL: white.
/// @param inverse_depth_sigma Standard deviation of inverse depths, 1/m: for cameras that triangulate.
///                            0.001425 is a Kinect's of the first kind.
/// @param depth_sigma         Standard deviation of depths besides, metres: for times of flight. Not
///                            both are 0.
/// @param cloud               Receives the cloud; free it with ptzcal_cloud_free.
/// @param error               Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for sizes that differ;
///         PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_BUFFER_TOO_SMALL for the image.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_from_depth_map(
    map: *const ptzcal_depth_map,
    camera: *const ptzcal_camera,
    image: *const ptzcal_image,
    inverse_depth_sigma: f64,
    depth_sigma: f64,
    cloud: *mut *mut ptzcal_cloud,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (cloud, rays) =
            unsafe { (HandleOut::new(cloud)?, depth_rays(map, camera, image, [inverse_depth_sigma, depth_sigma])?) };
        cloud.give(grid_cloud(&rays).into());
        Ok(())
    })
}

/// Frees a cloud.
///
/// @param cloud The cloud; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_free(cloud: *mut ptzcal_cloud) {
    // SAFETY: NULL or a live cloud that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(cloud) });
}

/// Adds points: all of them, or none.
///
/// @param cloud       The cloud.
/// @param xyz         n x 3 numbers: x, y, z, metres.
/// @param rgb         n x 3 bytes: red, green, blue; may be NULL: white.
/// @param covariances n x 6 numbers: xx, xy, xz, yy, yz, zz, m^2; may be NULL: unknown.
/// @param n           Number of points.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE, with the index of the point;
///         PTZCAL_STATUS_INVALID_ARGUMENT for a covariance that is none, for covariances where the
///         cloud's other points have none or the other way round, and for too many points;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_add_points(
    cloud: *mut ptzcal_cloud,
    xyz: *const f64,
    rgb: *const u8,
    covariances: *const f64,
    n: usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (cloud, xyz, rgb, covariances) = unsafe {
            (
                borrow(cloud)?,
                vectors::<3>(xyz, n, "xyz")?,
                if rgb.is_null() { None } else { Some(array(rgb.cast::<[u8; 3]>(), n, "rgb")?) },
                vectors_optional::<6>(covariances, n, "covariances")?,
            )
        };
        let more = PointCloud {
            positions: xyz.iter().map(|p| Vector3::from(*p)).collect(),
            colours: rgb.map_or_else(|| vec![[255; 3]; n], <[_]>::to_vec),
            normals: None,
            noise: covariances.map_or(CloudNoise::Unknown, |c| CloudNoise::Covariances(c.to_vec())),
        };
        more.validate()?;
        merge(&mut *cloud.0.write(ptzcal_cloud::NAME)?, &more)
    })
}

/// Adds another cloud's points: all of them, or none. Deviations become covariances where the other
/// cloud has those.
///
/// @param cloud The cloud.
/// @param other Another cloud.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT when only one of the two knows its noise or
///         has normals, which would be lost, and for too many points; PTZCAL_STATUS_BUSY, also for a
///         cloud merged with itself.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_merge(
    cloud: *mut ptzcal_cloud,
    other: *const ptzcal_cloud,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (cloud, other) = unsafe { (borrow(cloud)?, borrow(other)?) };
        let mut cloud = cloud.0.write(ptzcal_cloud::NAME)?;
        merge(&mut cloud, &*other.0.read("other")?)
    })
}

/// Forgets what is known of the noise and the normals, so that the cloud can be merged with one that
/// does not know them.
///
/// @param cloud The cloud.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_strip(cloud: *mut ptzcal_cloud, error: *mut *mut ptzcal_error) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let mut cloud = unsafe { borrow(cloud)? }.0.write(ptzcal_cloud::NAME)?;
        cloud.noise = CloudNoise::Unknown;
        cloud.normals = None;
        Ok(())
    })
}

/// Moves a cloud: X <- R X + t, with its normals and covariances.
///
/// @param cloud      The cloud.
/// @param pose       R and t; of station b in station a's frame it takes a cloud of b into a's frame.
/// @param covariance 36 numbers: the pose's covariance as ptzcal_pose_estimate_copy_covariance gives it,
///                   of the rotation vector in R <- exp([w]x) R (radians), then of t (metres). What the
///                   pose's error does to each point is added to its covariance; may be NULL: none.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT for what is no
///         rotation or no covariance; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_transform(
    cloud: *mut ptzcal_cloud,
    pose: *const ptzcal_pose,
    covariance: *const f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (cloud, pose, covariance) =
            unsafe { (borrow(cloud)?, pose_in(pose)?, vectors_optional::<36>(covariance, 1, "covariance")?) };
        let covariance = covariance.map(|c| SMatrix::<f64, 6, 6>::from_row_slice(&c[0]));
        transform(&mut *cloud.0.write(ptzcal_cloud::NAME)?, &pose, covariance.as_ref())
    })
}

/// Keeps the points inside a box, its faces included.
///
/// @param cloud    The cloud.
/// @param least    3 numbers: least x, y, z, metres.
/// @param greatest 3 numbers: greatest x, y, z, metres.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT for a least
///         coordinate above the greatest; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_crop(
    cloud: *mut ptzcal_cloud,
    least: *const f64,
    greatest: *const f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (cloud, least, greatest) =
            unsafe { (borrow(cloud)?, vectors::<3>(least, 1, "least")?, vectors::<3>(greatest, 1, "greatest")?) };
        let mut cloud = cloud.0.write(ptzcal_cloud::NAME)?;
        *cloud = crop(&cloud, &Vector3::from(least[0]), &Vector3::from(greatest[0]))?;
        Ok(())
    })
}

/// Thins a cloud out: the points in each cube of a grid through the origin become one, the mean weighted
/// by what is known of their noise, with the mean of their colours and the covariance of the mean.
///
/// @param cloud The cloud.
/// @param voxel Side of the cubes, metres.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT for a size that is
///         not positive, or so small that the cloud has more than 2^21 cubes along a side;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_thin(
    cloud: *mut ptzcal_cloud,
    voxel: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (cloud, voxel) = (unsafe { borrow(cloud)? }, number(voxel, "voxel")?);
        let mut cloud = cloud.0.write(ptzcal_cloud::NAME)?;
        *cloud = thin(&cloud, voxel)?;
        Ok(())
    })
}

/// How many points a cloud has, and what is known of them.
///
/// @param cloud   The cloud.
/// @param points  Receives the number of points; may be NULL.
/// @param noise   Receives a ptzcal_cloud_noise; may be NULL.
/// @param normals Receives 1 where there are normals, else 0; may be NULL.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_size(
    cloud: *const ptzcal_cloud,
    points: *mut usize,
    noise: *mut u32,
    normals: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (cloud, points, noise, normals) = unsafe {
            (
                borrow(cloud)?,
                Out::optional(points, "points")?,
                Out::optional(noise, "noise")?,
                Out::optional(normals, "normals")?,
            )
        };
        let cloud = cloud.0.read(ptzcal_cloud::NAME)?;
        if let Some(points) = points {
            points.write(cloud.len());
        }
        if let Some(noise) = noise {
            noise.write(match cloud.noise {
                CloudNoise::Unknown => ptzcal_cloud_noise::Unknown,
                CloudNoise::Deviations(_) => ptzcal_cloud_noise::Deviations,
                CloudNoise::Covariances(_) => ptzcal_cloud_noise::Covariances,
            } as u32);
        }
        if let Some(normals) = normals {
            normals.write(cloud.normals.is_some().into());
        }
        Ok(())
    })
}
