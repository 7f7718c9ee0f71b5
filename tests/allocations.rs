//! A spot detector allocates nothing any more once it has seen frames like those to come.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use ptzcal::detect::spot::{LaserColour, Region, Spot, SpotDetector, SpotOptions, detect_spot};
use ptzcal::image::{Image, ImageView, PixelFormat};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: the system's allocator does the work; counting allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: as the caller's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as the caller's.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: as the caller's.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations(run: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.get();
    run();
    ALLOCATIONS.get() - before
}

const SIZE: [u32; 2] = [320, 240];

/// A shaded scene with noise; with a spot, when it has a centre.
fn frame(format: PixelFormat, spot: Option<[f64; 2]>, rng: &mut ChaCha8Rng) -> Image {
    let mut image = Image::new(format, SIZE[0], SIZE[1]);
    let step = match format {
        PixelFormat::Bgr24 => 3,
        PixelFormat::Yuyv => 2,
        _ => 1,
    };
    for (i, byte) in image.data.iter_mut().enumerate() {
        let (x, y) = ((i / step % SIZE[0] as usize) as f64, (i / step / SIZE[0] as usize) as f64);
        let mut level = 60.0 + 20.0 * (x / 57.0).sin() * (y / 31.0).cos();
        if let Some([cx, cy]) = spot {
            level += 110.0 * (-((x - cx).powi(2) + (y - cy).powi(2)) / (2.0 * 1.9 * 1.9)).exp();
        }
        let noise: f64 = (0..4).map(|_| f64::from(rng.next_u32()) / 2f64.powi(32) - 0.5).sum();
        *byte = (level + 2.0 * noise).round() as u8;
    }
    // No colour.
    let luma = (SIZE[0] * SIZE[1]) as usize;
    match format {
        PixelFormat::Nv12 | PixelFormat::I420 => image.data[luma..].fill(128),
        PixelFormat::Yuyv => image.data.iter_mut().skip(1).step_by(2).for_each(|c| *c = 128),
        _ => {}
    }
    image
}

#[test]
fn spot_after_spot_is_found_without_an_allocation() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let region = Region { x: 130, y: 80, width: 64, height: 64 };
    let formats = [PixelFormat::Gray8, PixelFormat::Bgr24, PixelFormat::Nv12, PixelFormat::I420, PixelFormat::Yuyv];
    for (format, region, averaged) in
        formats.iter().flat_map(|f| [(*f, None, 1), (*f, None, 4), (*f, Some(region), 1), (*f, Some(region), 4)])
    {
        let options = SpotOptions { region, colour: LaserColour::Unknown, ..SpotOptions::default() };
        let mut detector = SpotDetector::default();
        let mut most = 0;
        for number in 0..8 {
            let centre = [150.3 + 1.7 * f64::from(number), 100.6 + 2.1 * f64::from(number)];
            let mut frames = |spot| -> Vec<Image> { (0..averaged).map(|_| frame(format, spot, &mut rng)).collect() };
            let (on, off) = (frames(Some(centre)), frames(None));
            let on: Vec<ImageView<'_>> = on.iter().map(|f| f.view().unwrap()).collect();
            let off: Vec<ImageView<'_>> = off.iter().map(|f| f.view().unwrap()).collect();
            let mut found: Option<Spot> = None;
            let count = allocations(|| found = detector.detect(&on, &off, &options).ok());
            let spot = found.unwrap_or_else(|| panic!("{format:?} {region:?}: no spot in frame {number}"));
            assert!((spot.x - centre[0]).hypot(spot.y - centre[1]) < 0.15, "{format:?}: {spot:?}, {centre:?}");
            // What it holds from before leaves no trace in the result.
            assert_eq!(Ok(spot), detect_spot(&on, &off, &options).map_err(|e| e.to_string()));
            // The first frames make room: noise decides how much is looked at closely.
            if number >= 3 {
                most = most.max(count);
            }
        }
        assert_eq!(most, 0, "{format:?} {region:?}, {averaged} frames averaged");
    }
}

/// The counter counts.
#[test]
fn a_detector_of_its_own_for_each_frame_allocates() {
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    let (on, off) =
        (frame(PixelFormat::Gray8, Some([100.0, 90.0]), &mut rng), frame(PixelFormat::Gray8, None, &mut rng));
    let (on, off) = ([on.view().unwrap()], [off.view().unwrap()]);
    assert!(allocations(|| assert!(detect_spot(&on, &off, &SpotOptions::default()).is_ok())) > 5);
}

/// Through the C ABI as well, which makes views of the host's frames.
#[test]
fn the_c_detector_allocates_nothing_either() {
    use ptzcal::capi::detect::{ptzcal_spot, ptzcal_spot_init};
    use ptzcal::capi::image::{ptzcal_image, ptzcal_image_init};
    use ptzcal::capi::spot_detector::{
        ptzcal_spot_detector_detect, ptzcal_spot_detector_free, ptzcal_spot_detector_new,
    };
    use std::ptr::{null, null_mut};
    let mut rng = ChaCha8Rng::seed_from_u64(14);
    let mut detector = null_mut();
    // SAFETY: pointers to what lives here, as the header demands.
    unsafe { assert!(ptzcal_spot_detector_new(null(), &mut detector, null_mut()) as i32 == 0) };
    let mut most = 0;
    for number in 0..8 {
        let centre = [150.3 + 1.7 * f64::from(number), 100.6];
        let frames = [Some(centre), None].map(|spot| frame(PixelFormat::Gray8, spot, &mut rng));
        let [on, off] = frames.each_ref().map(|frame| {
            let mut image = std::mem::MaybeUninit::<ptzcal_image>::uninit();
            // SAFETY: it has the size that is said, and is set up by the call.
            let mut image = unsafe {
                assert!(ptzcal_image_init(image.as_mut_ptr(), size_of::<ptzcal_image>()) as i32 == 0);
                image.assume_init()
            };
            (image.format, image.width, image.height) = (PixelFormat::Gray8 as u32, SIZE[0], SIZE[1]);
            (image.plane[0], image.stride[0], image.size[0]) =
                (frame.data.as_ptr().cast(), SIZE[0] as isize, frame.data.len());
            image
        });
        let mut spot = std::mem::MaybeUninit::<ptzcal_spot>::uninit();
        let pointers: [*const ptzcal_image; 2] = [&on, &off];
        // SAFETY: as above.
        let count = allocations(|| unsafe {
            assert!(ptzcal_spot_init(spot.as_mut_ptr(), size_of::<ptzcal_spot>()) as i32 == 0);
            let status =
                ptzcal_spot_detector_detect(detector, &pointers[0], 1, &pointers[1], 1, spot.as_mut_ptr(), null_mut());
            assert!(status as i32 == 0);
        });
        // SAFETY: set up and written above.
        let spot = unsafe { spot.assume_init() };
        assert!((spot.x - centre[0]).hypot(spot.y - centre[1]) < 0.15);
        if number >= 3 {
            most = most.max(count);
        }
    }
    // SAFETY: made above, and not used any more.
    unsafe { ptzcal_spot_detector_free(detector) };
    assert_eq!(most, 0);
}
