//! Meshes
//!
//! A textured surface, the 3D model of a scene: triangulated from a scan's grid of positions or from a
//! depth map, covered with pictures of calibrated cameras, and written as glTF or VRML.

use std::ffi::c_char;

use super::args::{BufferOut, Out, array, number};
use super::call::{ErrorOut, guard, guard_or};
use super::camera::{camera_in, ptzcal_camera};
use super::cloud::{depth_rays, ptzcal_cloud};
use super::depth::ptzcal_depth_map;
use super::error::ptzcal_error;
use super::file::path as path_in;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::image::{ptzcal_image, view};
use super::scan::ptzcal_scan;
use super::sized::{self, SizedStruct};
use super::status::ptzcal_status;
use crate::cloud::{Mesh, Picture, SurfaceOptions, mesh_depth, texture, triangulate};
use crate::error::{Error, Result};
use crate::format::{read_mesh, write_mesh};
use crate::geometry::Camera;
use crate::geometry::mesh::MAX_TEXTURES;
use crate::image::Image;

/// When neighbours of a grid are one surface. Neighbours are not joined where the depth jumps: where an
/// edge is steeper than max_incidence by more than the noise of its ends, and where neither the surface
/// before it nor the one behind it, extended, explains it.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_surface_options {
    /// Set by ptzcal_surface_options_init.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Angle between ray and normal, radians, up to which a surface needs no support from its
    /// neighbours: above 0 and below pi / 2.
    pub max_incidence: f64,
    /// Standard deviations beyond which a difference is not noise.
    pub significance: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_surface_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 8 + 2 * 8;
    fn initial() -> Self {
        let SurfaceOptions { max_incidence, significance } = SurfaceOptions::default();
        Self { struct_size: size_of::<Self>() as u32, reserved: 0, max_incidence, significance }
    }
}

/// The caller's options, or the defaults for NULL.
///
/// # Safety
/// `options` is NULL or a struct as long as its `struct_size` says.
unsafe fn settings(options: *const ptzcal_surface_options) -> Result<SurfaceOptions> {
    if options.is_null() {
        return Ok(SurfaceOptions::default());
    }
    // SAFETY: by this function's contract.
    let options = unsafe { sized::read(options)? };
    Ok(SurfaceOptions {
        max_incidence: number(options.max_incidence, "max_incidence")?,
        significance: number(options.significance, "significance")?,
    })
}

#[derive(Default)]
pub(super) struct Work {
    mesh: Mesh,
    /// For its textures.
    pictures: Vec<(Image, Camera)>,
}

/// Triangles between points, with pictures on them.
pub struct ptzcal_mesh(Exclusive<Work>);

impl Handle for ptzcal_mesh {
    const NAME: &'static str = "mesh";
}

impl From<Mesh> for ptzcal_mesh {
    fn from(mesh: Mesh) -> Self {
        Self(Exclusive::new(Work { mesh, pictures: Vec::new() }))
    }
}

/// Sets up options with their defaults.
///
/// @param options The struct.
/// @param size    sizeof *options.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_surface_options_init(
    options: *mut ptzcal_surface_options,
    size: usize,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Makes a mesh of given triangles.
///
/// @param vertices  The points; the mesh has a copy.
/// @param triangles n x 3 numbers of points, counter-clockwise for who sees the front.
/// @param n         Number of triangles.
/// @param mesh      Receives the mesh; free it with ptzcal_mesh_free.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a number that is no point's;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_mesh_new(
    vertices: *const ptzcal_cloud,
    triangles: *const u32,
    n: usize,
    mesh: *mut *mut ptzcal_mesh,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (mesh, vertices, triangles) =
            unsafe { (HandleOut::new(mesh)?, borrow(vertices)?, array(triangles.cast::<[u32; 3]>(), n, "triangles")?) };
        let vertices = vertices.0.read("vertices")?.clone();
        let made = Mesh { vertices, triangles: triangles.to_vec(), textures: Vec::new() };
        made.validate()?;
        mesh.give(made.into());
        Ok(())
    })
}

/// The surface through the points of a scan, on the grid of its region, with colours, normals and
/// covariances. Shots without a point are holes; the front is where the rig stood.
///
/// @param scan    The scan.
/// @param options The options; may be NULL: the defaults.
/// @param mesh    Receives the mesh; free it with ptzcal_mesh_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_mesh_from_scan(
    scan: *const ptzcal_scan,
    options: *const ptzcal_surface_options,
    mesh: *mut *mut ptzcal_mesh,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (mesh, scan, options) = unsafe { (HandleOut::new(mesh)?, borrow(scan)?, settings(options)?) };
        mesh.give(scan.0.surface(&options)?.into());
        Ok(())
    })
}

/// The surface that a depth map shows, in the world of its camera's pose.
///
/// @param map                 The map.
/// @param camera              Its camera, of the same size.
/// @param image               The camera's picture, of the same size, for the colours; may be NULL: white.
/// @param inverse_depth_sigma Standard deviation of inverse depths, 1/m.
/// @param depth_sigma         Standard deviation of depths besides, metres. Not both are 0.
/// @param options             The options; may be NULL: the defaults.
/// @param mesh                Receives the mesh; free it with ptzcal_mesh_free.
/// @param error               Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for sizes that differ;
///         PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_BUFFER_TOO_SMALL for the image.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_mesh_from_depth_map(
    map: *const ptzcal_depth_map,
    camera: *const ptzcal_camera,
    image: *const ptzcal_image,
    inverse_depth_sigma: f64,
    depth_sigma: f64,
    options: *const ptzcal_surface_options,
    mesh: *mut *mut ptzcal_mesh,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (mesh, rays, options) = unsafe {
            (
                HandleOut::new(mesh)?,
                depth_rays(map, camera, image, [inverse_depth_sigma, depth_sigma])?,
                settings(options)?,
            )
        };
        mesh.give(triangulate(&rays, &options)?.into());
        Ok(())
    })
}

/// Frees a mesh.
///
/// @param mesh The mesh; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_mesh_free(mesh: *mut ptzcal_mesh) {
    // SAFETY: NULL or a live mesh that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(mesh) });
}

/// Gives a mesh a picture for its textures; ptzcal_mesh_texture puts it on.
///
/// @param mesh   The mesh.
/// @param image  The picture; the mesh has a copy.
/// @param camera Where it was taken from: a camera of the picture's size.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a malformed image, sizes that differ, and
///         more than 256 pictures; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_BUFFER_TOO_SMALL;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_mesh_add_picture(
    mesh: *mut ptzcal_mesh,
    image: *const ptzcal_image,
    camera: *const ptzcal_camera,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (mesh, image, camera) = unsafe { (borrow(mesh)?, view(image)?, camera_in(camera)?) };
        if (image.width(), image.height()) != (camera.width, camera.height) {
            let reason = format!(
                "{} x {} pixels, its camera has {} x {}",
                image.width(),
                image.height(),
                camera.width,
                camera.height
            );
            return Err(Error::invalid("image", reason));
        }
        let mut work = mesh.0.write(ptzcal_mesh::NAME)?;
        if work.pictures.len() >= MAX_TEXTURES {
            return Err(Error::invalid("pictures", format!("more than {MAX_TEXTURES}")));
        }
        work.pictures.push((image.to_image(), camera));
        Ok(())
    })
}

/// Covers a mesh with the pictures added to it: each triangle gets the picture that shows its whole
/// front, unhidden, with the most pixels. Triangles that no picture shows keep their points' colours.
///
/// @param mesh    The mesh.
/// @param covered Receives the number of triangles with a picture; may be NULL.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a camera of more than 2^25 pixels;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_mesh_texture(
    mesh: *mut ptzcal_mesh,
    covered: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (mesh, covered) = unsafe { (borrow(mesh)?, Out::optional(covered, "covered")?) };
        let mut work = mesh.0.write(ptzcal_mesh::NAME)?;
        let Work { mesh, pictures } = &mut *work;
        let pictures = pictures.iter().map(|(image, camera)| Ok(Picture { image: image.view()?, camera }));
        let count = texture(mesh, &pictures.collect::<Result<Vec<_>>>()?)?;
        if let Some(covered) = covered {
            covered.write(count);
        }
        Ok(())
    })
}

/// How large a mesh is.
///
/// @param mesh      The mesh.
/// @param vertices  Receives the number of points; may be NULL.
/// @param triangles Receives the number of triangles; may be NULL.
/// @param textures  Receives the number of pictures on it; may be NULL.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_mesh_size(
    mesh: *const ptzcal_mesh,
    vertices: *mut usize,
    triangles: *mut usize,
    textures: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (mesh, vertices, triangles, textures) = unsafe {
            (
                borrow(mesh)?,
                Out::optional(vertices, "vertices")?,
                Out::optional(triangles, "triangles")?,
                Out::optional(textures, "textures")?,
            )
        };
        let mesh = &mesh.0.read(ptzcal_mesh::NAME)?.mesh;
        let sizes = [mesh.vertices.len(), mesh.triangles.len(), mesh.textures.len()];
        for (out, size) in [vertices, triangles, textures].into_iter().zip(sizes) {
            if let Some(out) = out {
                out.write(size);
            }
        }
        Ok(())
    })
}

/// A copy of a mesh's points, with their colours, normals and noise.
///
/// @param mesh  The mesh.
/// @param cloud Receives the cloud; free it with ptzcal_cloud_free.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_mesh_vertices(
    mesh: *const ptzcal_mesh,
    cloud: *mut *mut ptzcal_cloud,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (cloud, mesh) = unsafe { (HandleOut::new(cloud)?, borrow(mesh)?) };
        let vertices = mesh.0.read(ptzcal_mesh::NAME)?.mesh.vertices.clone();
        cloud.give(vertices.into());
        Ok(())
    })
}

/// Copies the triangles: n x 3 numbers of points, counter-clockwise for who sees the front.
///
/// @param mesh     The mesh.
/// @param buffer   Receives the numbers; may be NULL when `capacity` is 0.
/// @param capacity Numbers that fit into `buffer`.
/// @param needed   Receives how many numbers there are; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_mesh_copy_triangles(
    mesh: *const ptzcal_mesh,
    buffer: *mut u32,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (mesh, out) = unsafe { (borrow(mesh)?, BufferOut::new(buffer, capacity, needed)?) };
        out.write(mesh.0.read(ptzcal_mesh::NAME)?.mesh.triangles.as_flattened())
    })
}

/// Writes a mesh, in the format that the file's ending names: .glb (glTF 2.0, with everything), .wrl
/// (VRML97, with its pictures, without normals and noise) or .ply (without its pictures).
///
/// @param mesh  The mesh.
/// @param path  The file.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNSUPPORTED for another ending; PTZCAL_STATUS_FILE_IO;
///         PTZCAL_STATUS_DISK_FULL; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_mesh_save(
    mesh: *const ptzcal_mesh,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (mesh, path) = unsafe { (borrow(mesh)?, path_in(path)?) };
        write_mesh(&path, &mesh.0.read(ptzcal_mesh::NAME)?.mesh)
    })
}

/// Reads a mesh: .glb, .wrl or .ply, ours or another's.
///
/// @param path  The file.
/// @param mesh  Receives the mesh; free it with ptzcal_mesh_free.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNSUPPORTED for another ending, for what such a file may have
///         and this library does not read, and for more than 50,000,000 points or triangles;
///         PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT; PTZCAL_STATUS_FILE_VERSION.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_mesh_load(
    path: *const c_char,
    mesh: *mut *mut ptzcal_mesh,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (mesh, path) = unsafe { (HandleOut::new(mesh)?, path_in(path)?) };
        mesh.give(read_mesh(&path)?.into());
        Ok(())
    })
}

/// Depths of a surface in a camera's image, exact at the centre of every pixel whatever the lens; both
/// sides of the surface are seen. Where there is no surface there is no depth. The variances are those
/// of the triangles' planes, from the noise of the points.
///
/// @param mesh   The mesh.
/// @param camera The camera, of at most 2^25 pixels.
/// @param map    Receives the map; free it with ptzcal_depth_map_free.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_mesh_depth_map(
    mesh: *const ptzcal_mesh,
    camera: *const ptzcal_camera,
    map: *mut *mut ptzcal_depth_map,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (map, mesh, camera) = unsafe { (HandleOut::new(map)?, borrow(mesh)?, camera_in(camera)?) };
        let seen = mesh_depth(&mesh.0.read(ptzcal_mesh::NAME)?.mesh, &camera)?;
        map.give(seen.into());
        Ok(())
    })
}
