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
                let start = std::time::Instant::now();
                for _ in 0..20 { let _ = detect_chessboard(&image.view().unwrap(), &options); }
                let ms = start.elapsed().as_secs_f64() * 50.0;
                println!("{name:10} {n} of {} rms {:.4} nees {:.3} far {far} ordered {ordered} blur {:.2}  {ms:.2} ms", truth.len(), (square / n).sqrt(), nees / n, board.blur);
            }
            Err(e) => println!("{name:10} {e}"),
        }
    }
}
