//! Spot detection on real photographs of ../shared/data (or $PTZCAL_DATA); skipped when they are absent.

#[path = "support/data.rs"]
mod data;

use std::path::PathBuf;

use data::{folder, picture};
use ptzcal::detect::spot::{LaserColour, Region, Spot, SpotOptions, detect_spot};
use ptzcal::error::{Error, Result};
use ptzcal::image::Image;

fn single(image: &Image, colour: LaserColour) -> Result<Spot> {
    detect_spot(&[image.view().unwrap()], &[], &SpotOptions { colour, ..SpotOptions::default() })
}

#[test]
fn dots_in_single_photographs() {
    let Some(folder) = folder("laser_dot_yang") else { return };
    let labels = std::fs::read_to_string(folder.join("labels.csv")).unwrap();
    let mut found = 0;
    for line in labels.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        if fields[3] != "dot" {
            continue;
        }
        let [u, v] = [1, 2].map(|i| fields[i].parse::<f64>().unwrap());
        let image = picture(&folder.join(fields[0]));
        for colour in [LaserColour::Red, LaserColour::Unknown] {
            match single(&image, colour) {
                Ok(spot) => {
                    assert!((spot.x - u).hypot(spot.y - v) < 3.0, "{}: {spot:?}", fields[0]);
                    found += (colour == LaserColour::Red) as u32;
                }
                Err(e) => assert!(matches!(e, Error::Ambiguous { .. }), "{}: {e}", fields[0]),
            }
        }
    }
    println!("{found} of 4 dots found with the colour known");
    assert!(found >= 3);
}

/// Parts of the photographs without laser light hold lamps, stickers, print and glare, but no spot.
#[test]
fn parts_without_the_dot_have_none() {
    let Some(folder) = folder("laser_dot_yang") else { return };
    let labels = std::fs::read_to_string(folder.join("labels.csv")).unwrap();
    let labels: Vec<Vec<&str>> = labels.lines().skip(1).map(|l| l.split(',').collect()).collect();
    for name in ["1.jpg", "4.jpg", "5.jpg", "7.jpg"] {
        let image = picture(&folder.join(name));
        let [width, height] = [480, 270];
        for (x, y) in (0..8).flat_map(|i| (0..8).map(move |j| (i * width, j * height))) {
            let lit = labels.iter().filter(|l| l[0] == name).any(|l| {
                let [u, v] = [1, 2].map(|i| l[i].parse::<f64>().unwrap());
                let [dx, dy] = [u - x as f64, v - y as f64];
                (-30.0..width as f64 + 30.0).contains(&dx) && (-30.0..height as f64 + 30.0).contains(&dy)
            });
            if !lit {
                let region = Some(Region { x, y, width, height });
                let options = SpotOptions { region, colour: LaserColour::Red, ..SpotOptions::default() };
                let result = detect_spot(&[image.view().unwrap()], &[], &options);
                assert!(result.is_err(), "{name} {options:?}: {result:?}");
            }
        }
    }
}

#[test]
fn a_line_laser_is_no_spot() {
    let Some(folder) = folder("laser_line_onoff") else { return };
    for pair in [1, 2, 4, 5, 6] {
        let [off, on] = ["a", "b"].map(|ab| picture(&folder.join(format!("sample{pair}-{ab}-0.jpg"))));
        for colour in [LaserColour::Red, LaserColour::Unknown] {
            let options = SpotOptions { colour, ..SpotOptions::default() };
            let result = detect_spot(&[on.view().unwrap()], &[off.view().unwrap()], &options);
            assert!(matches!(result, Err(Error::NotFound { .. } | Error::Ambiguous { .. })), "pair {pair}: {result:?}");
        }
    }
}

/// Photographs of other scenes, alone, and as if
/// the next one of the folder had been taken with the laser on.
#[test]
fn scenes_without_a_laser_have_no_spot() {
    for name in
        ["meva/frames", "bouguet_opencv_stereo14", "boof_sony_chess", "rgbd_nyu", "rgbd_icl", "rgbd_redwood_open3d"]
    {
        let Some(folder) = folder(name) else { continue };
        let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).collect();
        paths.retain(|p| {
            let is_picture = p.extension().is_some_and(|e| e == "jpg" || e == "png");
            is_picture && !p.file_name().unwrap().to_string_lossy().starts_with("depth")
        });
        paths.sort();
        let images: Vec<Image> = paths.iter().map(|p| picture(p)).collect();
        for colour in [LaserColour::Red, LaserColour::Green, LaserColour::Unknown, LaserColour::White] {
            let options = SpotOptions { colour, ..SpotOptions::default() };
            for (image, path) in images.iter().zip(&paths) {
                let result = single(image, colour);
                // A police car's flashing light, burnt out with a blue rim, is a spot for all one image can tell.
                let lamp = path.ends_with("G506.png") && colour == LaserColour::Unknown;
                assert!(lamp || result.is_err(), "{colour:?} {path:?}: {result:?}");
            }
            for (i, pair) in images.windows(2).enumerate().filter(|(_, p)| p[0].data.len() == p[1].data.len()) {
                let result = detect_spot(&[pair[1].view().unwrap()], &[pair[0].view().unwrap()], &options);
                assert!(result.is_err(), "{colour:?} {:?} and the next: {result:?}", paths[i]);
            }
        }
    }
}
