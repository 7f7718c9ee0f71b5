//! Chessboard detection on real photographs of ../shared/data (or $PTZCAL_DATA); skipped when they are absent.

#[path = "support/data.rs"]
mod data;

use std::path::{Path, PathBuf};

use data::{folder, numbers, picture};
use nalgebra::Vector2;
use ptzcal::detect::chessboard::{Chessboard, ChessboardOptions, detect_chessboard};
use ptzcal::error::{Result, Status};
use ptzcal::geometry::{Distortion, Intrinsics, homography};

fn pictures(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "jpg" || e == "png" || e == "pgm"));
    paths.sort();
    paths
}

fn detect(path: &Path, size: Option<[u32; 2]>) -> Result<Chessboard> {
    detect_chessboard(&picture(path).view().unwrap(), &ChessboardOptions { size, ..ChessboardOptions::default() })
}

/// All corners of the board in row-major order.
fn corners(path: &Path, size: [u32; 2]) -> Vec<Vector2<f64>> {
    let board = detect(path, Some(size)).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    assert_eq!(board.found(), board.corners.len(), "{}", path.display());
    board.corners.iter().flatten().map(|c| Vector2::new(c.x, c.y)).collect()
}

/// Squared distances in pixels of the corners from a flat board seen through a known lens.
fn residuals(lens: &(Intrinsics, Distortion), corners: &[Vector2<f64>], columns: usize) -> Vec<f64> {
    let board: Vec<_> = (0..corners.len()).map(|i| Vector2::new((i % columns) as f64, (i / columns) as f64)).collect();
    let (intrinsics, distortion) = lens;
    let flat: Vec<_> = corners.iter().map(|c| distortion.undistort(intrinsics.to_normalised(c)).unwrap()).collect();
    let h = homography::estimate(&board, &flat).unwrap();
    let seen = |p: &Vector2<f64>| intrinsics.to_pixel(&distortion.distort(homography::apply(&h, p).unwrap()).unwrap());
    board.iter().zip(corners).map(|(p, c)| (seen(p) - c).norm_squared()).collect()
}

fn rms(squares: &[f64]) -> f64 {
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// 28 photographs against the corners and the lenses of Bouguet's toolbox, which a person guided.
#[test]
fn all_boards_of_the_stereo_pairs() {
    let Some(folder) = folder("bouguet_opencv_stereo14") else { return };
    let left = (
        Intrinsics { fx: 533.0037, fy: 533.1526, skew: 0.0, cx: 341.5861, cy: 234.2594 },
        Distortion::BrownConrady([-0.289471, 0.103253, 0.00103131, -0.00028860, 0.0]),
    );
    let right = (
        Intrinsics { fx: 536.9826, fy: 536.5694, skew: 0.0, cx: 326.4721, cy: 249.3326 },
        Distortion::BrownConrady([-0.289361, 0.106768, -0.00078148, 0.00019605, 0.0]),
    );
    let (mut apart, mut ours, mut theirs) = (Vec::new(), Vec::new(), Vec::new());
    for path in pictures(&folder) {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let corners = corners(&path, [9, 6]);
        let toolbox: Vec<_> = numbers(&folder.join(format!("corners_toolbox/{name}.csv")))
            .unwrap()
            .into_iter()
            .filter(|row| row.len() == 4)
            .map(|row| Vector2::new(row[2], row[3]))
            .collect();
        assert_eq!(toolbox.len(), 54);
        let nearest =
            |c: &Vector2<f64>| *toolbox.iter().min_by(|a, b| (*a - c).norm().total_cmp(&(*b - c).norm())).unwrap();
        let matched: Vec<_> = corners.iter().map(nearest).collect();
        apart.extend(corners.iter().zip(&matched).map(|(a, b)| (a - b).norm_squared()));
        let lens = if name.starts_with("left") { &left } else { &right };
        ours.extend(residuals(lens, &corners, 9));
        theirs.extend(residuals(lens, &matched, 9));
    }
    let (apart, worst, ours, theirs) =
        (rms(&apart), apart.iter().copied().fold(0.0, f64::max).sqrt(), rms(&ours), rms(&theirs));
    println!(
        "{apart:.3} px rms from the toolbox's corners, at most {worst:.3}; residual {ours:.4}, the toolbox's {theirs:.4}"
    );
    assert!(apart < 0.12 && worst < 0.5);
    // Its lenses are fitted to its own corners.
    assert!(ours < theirs);
}

#[test]
fn all_boards_of_the_sony_camera() {
    let Some(folder) = folder("boof_sony_chess") else { return };
    let lens = (
        Intrinsics { fx: 701.0117, fy: 698.6538, skew: 0.0, cx: 308.4552, cy: 246.8430 },
        Distortion::BrownConrady([-0.255592, 0.099971, 0.0, 0.0, 0.0]),
    );
    let paths = pictures(&folder);
    assert_eq!(paths.len(), 13);
    let ours: Vec<f64> = paths.iter().flat_map(|path| residuals(&lens, &corners(path, [4, 6]), 4)).collect();
    println!("residual {:.4}", rms(&ours));
    // The board is not flat to better: OpenCV's corners leave 0.16.
    assert!(rms(&ours) < 0.16);
}

/// Photographs and depth images without a chessboard; Zhang's boards have squares that do not touch.
#[test]
fn scenes_without_a_board_have_none() {
    for name in [
        "laser_dot_yang",
        "laser_line_onoff",
        "meva/frames",
        "rgbd_cape_tunnel",
        "rgbd_icl",
        "rgbd_nyu",
        "rgbd_redwood_open3d",
        "zhang_msr",
    ] {
        let Some(folder) = folder(name) else { continue };
        let paths = pictures(&folder);
        assert!(!paths.is_empty(), "{name}");
        for path in paths {
            for size in [Some([9, 6]), Some([4, 6]), Some([3, 3]), None] {
                let refused = detect(&path, size).map(|b| (b.columns, b.rows, b.found()));
                let status = refused.as_ref().map_err(|e| e.status());
                assert_eq!(status, Err(Status::NotFound), "{} {size:?}: {refused:?}", path.display());
            }
        }
    }
}
