use super::render::Scene;
use super::*;

#[test]
fn explore() {
    for (name, scene) in [
        ("frontal", Scene::default()),
        ("tilted", Scene { turn: [0.6, 0.4, 0.2], ..Scene::default() }),
        ("steep", Scene { turn: [0.0, 1.1, 0.1], place: [0.0, 0.0, 14.0], ..Scene::default() }),
        ("small", Scene { place: [0.0, 0.0, 70.0], ..Scene::default() }),
        ("lens", Scene { bend: 0.4, place: [0.0, 0.0, 9.0], ..Scene::default() }),
        ("blur 3", Scene { blur: 3.0, ..Scene::default() }),
        ("blur 6", Scene { blur: 6.0, ..Scene::default() }),
        ("sharp .25", Scene { turn: [0.6, 0.4, 0.2], blur: 0.25, ..Scene::default() }),
        ("sharp .4", Scene { turn: [0.6, 0.4, 0.2], blur: 0.4, ..Scene::default() }),
        ("sharp .4n1", Scene { turn: [0.6, 0.4, 0.2], blur: 0.4, noise: 1.0, ..Scene::default() }),
        ("sharp .6", Scene { turn: [0.6, 0.4, 0.2], blur: 0.6, ..Scene::default() }),
        ("small tilt", Scene { place: [0.0, 0.0, 60.0], turn: [0.6, 0.8, 0.2], ..Scene::default() }),
        ("tiny tilt", Scene { place: [0.0, 0.0, 75.0], turn: [0.6, 0.8, 0.2], blur: 0.7, ..Scene::default() }),
        ("tiny", Scene { place: [0.0, 0.0, 110.0], turn: [0.1, 0.2, 0.2], blur: 0.7, ..Scene::default() }),
        ("steep 70", Scene { turn: [0.0, 1.22, 0.1], place: [0.0, 0.0, 14.0], ..Scene::default() }),
        ("steep 75", Scene { turn: [1.31, 0.0, 0.1], place: [0.0, 0.0, 16.0], ..Scene::default() }),
        ("diag 65", Scene { turn: [0.8, 0.8, 0.0], place: [0.0, 0.0, 18.0], ..Scene::default() }),
        ("lens 1.0", Scene { bend: 1.2, focal: 350.0, place: [0.0, 0.0, 5.5], ..Scene::default() }),
        ("noise 12", Scene { noise: 12.0, ..Scene::default() }),
        ("faint", Scene { dark: 100.0, bright: 120.0, ..Scene::default() }),
        ("light", Scene { light: [1.2, 0.6], turn: [0.3, 0.3, 0.4], dark: 15.0, bright: 130.0, ..Scene::default() }),
        ("clutter", Scene { clutter: 100.0, turn: [0.3, 0.3, 0.4], ..Scene::default() }),
        ("turned", Scene { turn: [0.0, 0.0, 3.0], ..Scene::default() }),
        ("mirrored", Scene { mirrored: true, turn: [0.1, 0.3, 0.5], ..Scene::default() }),
        ("hidden", Scene { hidden: vec![[300.0, 200.0, 345.0, 290.0, 120.0]], ..Scene::default() }),
        ("3x3", Scene { board: [3, 3], ..Scene::default() }),
        ("1080p", Scene { image: [1920, 1080], focal: 1800.0, board: [14, 10], place: [0.0, 0.0, 22.0], turn: [0.3, 0.4, 0.1], ..Scene::default() }),
    ] {
        let image = scene.render();
        let truth = scene.corners();
        let out = truth.iter().filter(|t| t[0] < 8.0 || t[1] < 8.0 || t[0] > scene.image[0] as f64 - 9.0 || t[1] > scene.image[1] as f64 - 9.0).count();
        if out > 0 { println!("{out} outside"); }
        let options = ChessboardOptions { size: Some(scene.board.map(|n| n as u32)), ..Default::default() };
        match detect_chessboard(&image.view().unwrap(), &options) {
            Ok(board) => {
                let (mut square, mut nees, mut n) = (0.0, 0.0, 0.0);
                let mut far = 0;
                for c in board.corners.iter().flatten() {
                    let e = truth.iter().map(|t| [c.x - t[0], c.y - t[1]]).min_by(|a, b| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1]))).unwrap();
                    let [a, b, d] = c.covariance;
                    square += e[0] * e[0] + e[1] * e[1];
                    nees += (d * e[0] * e[0] - 2.0 * b * e[0] * e[1] + a * e[1] * e[1]) / (a * d - b * b) / 2.0;
                    n += 1.0;
                    far += (e[0].hypot(e[1]) > 0.5) as u32;
                }
                let ordered = board.corners.iter().zip(&truth).filter(|(c, t)| c.is_some_and(|c| (c.x - t[0]).hypot(c.y - t[1]) < 1.0)).count();
                let square: f64 = square;
                let ms = (0..30).map(|_| { let start = std::time::Instant::now(); let _ = detect_chessboard(&image.view().unwrap(), &options); start.elapsed().as_secs_f64() * 1e3 }).fold(1e9, f64::min);
                println!("{name:10} {n} of {} rms {:.4} nees {:.3} far {far} ordered {ordered} blur {:.2}  {ms:.2} ms", truth.len(), (square / n).sqrt(), nees / n, board.blur);
            }
            Err(e) => println!("{name:10} {e}"),
        }
    }
}


