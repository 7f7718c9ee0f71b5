//! Against renders whose corners are known.

use super::render::Scene;
use super::*;
use crate::error::Status;
use crate::image::{Image, PixelFormat};

fn options(scene: &Scene) -> ChessboardOptions {
    ChessboardOptions { size: Some(scene.board.map(|n| n as u32)), ..ChessboardOptions::default() }
}

fn detect(image: &Image, size: Option<[u32; 2]>) -> Result<Chessboard> {
    detect_chessboard(&image.view().unwrap(), &ChessboardOptions { size, ..ChessboardOptions::default() })
}

fn found(name: &str, scene: &Scene) -> Chessboard {
    detect_chessboard(&scene.render().view().unwrap(), &options(scene)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Errors of the corners that were found, in the order of the truth.
fn errors(board: &Chessboard, truth: &[[f64; 2]]) -> Vec<([f64; 2], [f64; 3])> {
    let pairs = board.corners.iter().zip(truth);
    pairs.filter_map(|(c, t)| c.map(|c| ([c.x - t[0], c.y - t[1]], c.covariance))).collect()
}

fn worst(errors: &[([f64; 2], [f64; 3])]) -> f64 {
    errors.iter().map(|(e, _)| e[0].hypot(e[1])).fold(0.0, f64::max)
}

/// Root mean square error, and mean of e^T C^-1 e / 2 (1 for an honest covariance).
fn statistics(errors: &[([f64; 2], [f64; 3])]) -> [f64; 2] {
    let n = errors.len() as f64;
    let square: f64 = errors.iter().map(|(e, _)| e[0] * e[0] + e[1] * e[1]).sum();
    let normalised = |([x, y], [xx, xy, yy]): &([f64; 2], [f64; 3])| {
        0.5 * (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
    };
    [(square / n).sqrt(), errors.iter().map(normalised).sum::<f64>() / n]
}

/// Blur 1 px, noise 3 grey levels: a dozen views, 648 corners. The goal is 0.035 px; NEES has a standard
/// deviation of 0.04.
#[test]
fn corners_are_right_to_hundredths_and_say_how_much() {
    let turns = [[0.0; 3], [0.3, 0.2, 0.1], [0.6, 0.4, 0.2], [-0.5, 0.7, -0.4], [0.2, -0.9, 0.6], [1.0, 0.2, -0.1]];
    let mut all = Vec::new();
    for (i, turn) in turns.into_iter().chain(turns).enumerate() {
        let far = if i < turns.len() { 16.0 } else { 24.0 };
        let bend = if i % 2 == 0 { 0.0 } else { 0.15 };
        let place = [0.13 * i as f64 - 0.6, 0.4 - 0.07 * i as f64, far];
        let scene = Scene { turn, place, bend, light: [0.3, -0.2], seed: i as u64, ..Scene::default() };
        let board = found("view", &scene);
        assert_eq!(board.found(), 54, "view {i}");
        assert!((board.blur - 1.04).abs() < 0.08, "view {i}: blur {}", board.blur);
        all.extend(errors(&board, &scene.corners()));
    }
    let [rms, nees] = statistics(&all);
    println!("{} corners: {rms:.4} px rms, NEES {nees:.3}", all.len());
    assert!(rms < 0.035, "{rms}");
    assert!((0.9..1.1).contains(&nees), "{nees}");
    assert!(worst(&all) < 0.15);
}

/// Every corner, in the order of the board, and none far off.
#[test]
fn hard_views_are_found_whole() {
    let scene = Scene::default;
    for (name, most, scene) in [
        ("tilted by 70 degrees", 0.15, Scene { turn: [0.0, 1.22, 0.1], place: [0.0, 0.0, 14.0], ..scene() }),
        ("tilted by 75 degrees", 0.2, Scene { turn: [1.31, 0.0, 0.1], place: [0.0, 0.0, 16.0], ..scene() }),
        ("tilted over a corner", 0.2, Scene { turn: [0.8, 0.8, 0.0], place: [0.0, 0.0, 18.0], ..scene() }),
        ("wide angle", 0.15, Scene { bend: 1.2, focal: 350.0, place: [0.0, 0.0, 5.5], ..scene() }),
        ("squares of 8 pixels", 0.15, Scene { place: [0.0, 0.0, 75.0], turn: [0.1, 0.2, 0.2], ..scene() }),
        ("8 pixels, tilted", 0.2, Scene { place: [0.0, 0.0, 75.0], turn: [0.6, 0.8, 0.2], blur: 0.7, ..scene() }),
        ("squares of 5.5 pixels", 0.2, Scene { place: [0.0, 0.0, 110.0], blur: 0.7, ..scene() }),
        ("blur 6", 0.2, Scene { blur: 6.0, ..scene() }),
        ("sharp", 0.1, Scene { blur: 0.25, turn: [0.6, 0.4, 0.2], ..scene() }),
        ("noise 12", 0.3, Scene { noise: 12.0, ..scene() }),
        ("contrast 20", 0.6, Scene { dark: 100.0, bright: 120.0, ..scene() }),
        ("uneven light", 0.2, Scene { light: [1.2, 0.6], bright: 130.0, turn: [0.3, 0.3, 0.4], ..scene() }),
        ("clutter", 0.15, Scene { clutter: 100.0, turn: [0.3, 0.3, 0.4], ..scene() }),
        ("upside down", 0.15, Scene { turn: [0.0, 0.0, 3.0], ..scene() }),
        ("3 x 4", 0.15, Scene { board: [3, 4], ..scene() }),
    ] {
        let board = found(name, &scene);
        assert_eq!(board.found(), board.corners.len(), "{name}");
        let worst = worst(&errors(&board, &scene.corners()));
        println!("{name}: worst {worst:.3} px");
        assert!(worst < most, "{name}: {worst}");
    }
    // Each corner is twice as far from its neighbours as VGA's.
    let large = Scene { image: [1920, 1080], focal: 1800.0, board: [14, 11], place: [0.0, 0.0, 26.0], ..scene() };
    let board = found("1080p", &Scene { turn: [0.3, 0.4, 0.1], ..large.clone() });
    assert_eq!(board.found(), 154);
}

#[test]
fn hidden_corners_are_left_out_and_the_rest_kept_in_order() {
    let scene = Scene { turn: [0.2, 0.3, 0.1], hidden: vec![[300.0, 200.0, 360.0, 290.0, 128.0]], ..Scene::default() };
    let (board, truth) = (found("hidden", &scene), scene.corners());
    let [left, top, right, bottom, _] = scene.hidden[0];
    for (corner, [x, y]) in board.corners.iter().zip(&truth) {
        let outside = (left - x).max(x - right).max((top - y).max(y - bottom));
        // Within a few pixels of the rim either is right.
        assert!(outside > 0.0 || corner.is_none(), "hidden corner at {x:.0} {y:.0}");
        assert!(outside < 8.0 || corner.is_some(), "corner in view at {x:.0} {y:.0}");
    }
    // Beside the rim part of a corner's window is covered.
    let worst = worst(&errors(&board, &truth));
    assert!(board.found() < 54 && worst < 0.3, "{} corners, {worst}", board.found());
    let all = ChessboardOptions { min_found: 1.0, ..options(&scene) };
    let refused = detect_chessboard(&scene.render().view().unwrap(), &all).unwrap_err();
    assert_eq!(refused.status(), Status::NotFound);
    // Without its last column the board could be any part of one.
    let cut = Scene { turn: [0.0; 3], hidden: vec![[450.0, 0.0, 640.0, 480.0, 128.0]], ..scene };
    let refused = detect_chessboard(&cut.render().view().unwrap(), &options(&cut)).unwrap_err();
    assert!(refused.to_string().contains("not 9 x 6"), "{refused}");
}

/// Whatever the camera's roll, a board with one even and one odd side is read in its own order; others
/// begin at the upper left.
#[test]
fn the_order_is_the_documented_one() {
    for roll in [0.0, 1.0, 2.0, 3.1, -0.8, -2.2] {
        let turned = |board| Scene { board, turn: [0.0, 0.0, roll], place: [0.0, 0.0, 20.0], ..Scene::default() };
        let scene = turned([7, 4]);
        assert!(worst(&errors(&found("7 x 4", &scene), &scene.corners())) < 0.15, "roll {roll}");
        for board in [[7, 5], [6, 4], [5, 5], [4, 4]] {
            let scene = turned(board);
            let (seen, truth) = (found("symmetric", &scene), scene.corners());
            let place = |i: usize| seen.corners[i].map(|c| [c.x, c.y]).unwrap();
            let index = |p: [f64; 2]| truth.iter().position(|t| (t[0] - p[0]).hypot(t[1] - p[1]) < 0.2).unwrap();
            let (columns, rows) = (board[0], board[1]);
            let [first, along, down] = [0, 1, columns].map(place);
            let turn = (along[0] - first[0]) * (down[1] - first[1]) - (along[1] - first[1]) * (down[0] - first[0]);
            assert!(turn > 0.0, "{board:?} roll {roll}: not clockwise");
            // All corners once; the least x + y of the board's corners with a dark square outside.
            let mut order: Vec<usize> = (0..columns * rows).map(|i| index(place(i))).collect();
            let sum = |i: usize| truth[i][0] + truth[i][1];
            let corners = [0, columns - 1, columns * (rows - 1), columns * rows - 1];
            let fits = |i: &usize| {
                let rotated = *i == 0 || *i == columns * rows - 1;
                // On the board the squares of even number are dark, the first one too.
                let side = |at: usize, most: usize| if at == 0 { 0 } else { most };
                let dark = (side(i % columns, columns) + side(i / columns, rows)) % 2 == 0;
                dark && (rotated || columns == rows)
            };
            let least = corners.into_iter().filter(fits).map(sum).fold(f64::INFINITY, f64::min);
            assert_eq!(sum(order[0]), least, "{board:?} roll {roll}: begins at {}", order[0]);
            order.sort_unstable();
            assert!(order.into_iter().eq(0..columns * rows));
        }
    }
    // A mirrored view is read as its mirror image: here each column from its other end.
    let scene = Scene { mirrored: true, turn: [0.1, 0.3, 0.2], ..Scene::default() };
    let (board, truth) = (found("mirrored", &scene), scene.corners());
    let reversed: Vec<[f64; 2]> = truth.chunks(9).rev().flatten().copied().collect();
    assert!(worst(&errors(&board, &reversed)) < 0.15);
}

#[test]
fn boards_of_another_size_are_refused_and_of_unknown_size_found() {
    let scene = Scene { board: [8, 7], turn: [0.4, -0.5, 0.2], place: [0.0, 0.0, 18.0], ..Scene::default() };
    let image = scene.render();
    for size in [[8, 6], [7, 7], [7, 6], [3, 3], [9, 7], [8, 8], [30, 20]] {
        let refused = detect(&image, Some(size)).unwrap_err();
        assert_eq!(refused, Error::NoChessboard { reason: refused_reason(size) }, "{size:?}");
    }
    let board = detect(&image, None).unwrap();
    assert_eq!([board.columns, board.rows, board.found()], [8, 7, 56]);
    assert!(worst(&errors(&board, &scene.corners())) < 0.15);
    // The same, the other way about.
    let board = detect(&image, Some([7, 8])).unwrap();
    assert_eq!([board.columns, board.rows, board.found()], [7, 8, 56]);
}

fn refused_reason([columns, rows]: [u32; 2]) -> String {
    format!("the largest grid has 8 x 7 corners, not {columns} x {rows}")
}

/// Two pictures side by side.
fn beside(a: &Image, b: &Image) -> Image {
    let mut image = Image::new(PixelFormat::Gray8, a.width + b.width, a.height);
    let rows = a.data.chunks_exact(a.width as usize).zip(b.data.chunks_exact(b.width as usize));
    for ((a, b), out) in rows.zip(image.data.chunks_exact_mut((image.width) as usize)) {
        out[..a.len()].copy_from_slice(a);
        out[a.len()..].copy_from_slice(b);
    }
    image
}

#[test]
fn of_two_boards_the_larger_is_taken_or_none() {
    let near = Scene { turn: [0.2, 0.1, 0.0], ..Scene::default() };
    let far = Scene { place: [0.0, 0.0, 50.0], ..near.clone() };
    let other = Scene { turn: [-0.2, 0.3, 0.3], seed: 2, ..Scene::default() };
    let refused = detect(&beside(&near.render(), &other.render()), Some([9, 6])).unwrap_err();
    assert_eq!(refused.status(), Status::Ambiguous, "{refused}");
    let board = detect(&beside(&near.render(), &far.render()), Some([9, 6])).unwrap();
    assert!(worst(&errors(&board, &near.corners())) < 0.15);
}

/// One colour, ramps, noise, the smallest images, and boards without end: nothing, and in little time.
#[test]
fn what_is_no_board_is_refused() {
    let picture = |width: u32, height: u32, level: &mut dyn FnMut(u32, u32) -> u8| {
        let mut image = Image::new(PixelFormat::Gray8, width, height);
        image.data.iter_mut().enumerate().for_each(|(i, p)| *p = level(i as u32 % width, i as u32 / width));
        image
    };
    let mut state = 1u32;
    let mut noise = |_, _| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    for (name, image) in [
        ("black", picture(640, 480, &mut |_, _| 0)),
        ("white", picture(640, 480, &mut |_, _| 255)),
        ("ramp", picture(640, 480, &mut |x, y| (x / 4 + y / 8) as u8)),
        ("stripes", picture(640, 480, &mut |x, _| if x % 16 < 8 { 30 } else { 220 })),
        ("noise", picture(640, 480, &mut noise)),
        ("dots", picture(640, 480, &mut |x, y| if x % 24 < 12 && y % 24 < 12 { 30 } else { 220 })),
        ("squares everywhere", picture(1280, 960, &mut |x, y| if (x / 7 + y / 7) % 2 == 0 { 30 } else { 220 })),
        ("single pixels", picture(640, 480, &mut |x, y| if (x + y) % 2 == 0 { 0 } else { 255 })),
        ("smallest", picture(30, 22, &mut |x, y| (x * y) as u8)),
    ] {
        for size in [Some([9, 6]), Some([3, 3]), None] {
            let Err(refused) = detect(&image, size) else {
                // More than half of the squares are within the image, and make a board of their own size.
                assert!(name == "squares everywhere" && size.is_none(), "{name} {size:?}");
                continue;
            };
            let too_small = name == "smallest" && size == Some([9, 6]);
            let status = if too_small { Status::InvalidArgument } else { Status::NotFound };
            assert_eq!(refused.status(), status, "{name} {size:?}: {refused}");
        }
    }
    for (width, height) in [(1, 1), (1, 2000), (2000, 1), (15, 15), (400, 15)] {
        let refused = detect(&picture(width, height, &mut |x, y| (31 * x + 17 * y) as u8), None).unwrap_err();
        assert!(matches!(refused, Error::InvalidArgument { name: "image", .. }), "{width} x {height}: {refused}");
    }
}

#[test]
fn impossible_options_are_refused() {
    let image = Image::new(PixelFormat::Gray8, 640, 480);
    for size in [[2, 6], [6, 2], [0, 0], [129, 6], [6, u32::MAX]] {
        let refused = detect(&image, Some(size)).unwrap_err();
        assert!(matches!(refused, Error::InvalidArgument { name: "size", .. }), "{size:?}: {refused}");
    }
    for min_found in [-0.1, 1.1, f64::NAN, f64::INFINITY] {
        let options = ChessboardOptions { size: Some([9, 6]), min_found };
        let refused = detect_chessboard(&image.view().unwrap(), &options).unwrap_err();
        assert!(matches!(refused, Error::InvalidArgument { name: "min_found", .. }), "{min_found}: {refused}");
    }
}

/// Colours by their luma, rows in any order; the same corners.
#[test]
fn every_layout_is_read() {
    let scene = Scene { image: [320, 240], focal: 300.0, ..Scene::default() };
    let grey = scene.render();
    let wanted = detect(&grey, Some([9, 6])).unwrap();
    let mut colour = Image::new(PixelFormat::Bgra32, 320, 240);
    colour.data.chunks_exact_mut(4).zip(&grey.data).for_each(|(p, g)| p.copy_from_slice(&[*g, *g, *g, 7]));
    assert_eq!(detect(&colour, Some([9, 6])).unwrap(), wanted);
    let rows: Vec<&[u8]> = grey.data.chunks_exact(320).rev().collect();
    let (flipped, size) = (rows.concat(), Some([9, 6]));
    let view = ImageView::new(PixelFormat::Gray8, 320, 240, &[(&flipped, -320)]).unwrap();
    assert_eq!(detect_chessboard(&view, &ChessboardOptions { size, ..Default::default() }).unwrap(), wanted);
}

/// A checkered floor is no board, and neither are pieces of it.
#[test]
fn more_corners_than_any_board_has_are_no_board() {
    let mut image = Image::new(PixelFormat::Gray8, 900, 900);
    for (i, v) in image.data.iter_mut().enumerate() {
        let (x, y) = (i % 900, i / 900);
        *v = if (x / 6 + y / 6) % 2 == 0 { 60 } else { 190 };
    }
    let found = detect(&image, None).map(|b| [b.columns, b.rows]);
    assert_eq!(found.map_err(|e| e.status()), Err(Status::NotFound));
}
