import unittest

import numpy as np

import ptzcal
from support import TestCase, spot_frames

CENTRE = (180.3, 95.6)


class Detection(TestCase):
    def test_a_spot(self):
        spot = ptzcal.detect_spot(*spot_frames())
        self.assertClose(spot.centre, CENTRE, atol=0.1)
        self.assertEqual(spot.covariance.shape, (2, 2))
        self.assertTrue((np.linalg.eigvalsh(spot.covariance) > 0).all())
        self.assertClose(spot.peak, 120, atol=15)
        self.assertGreater(spot.signal_to_noise, 20)
        self.assertGreater(spot.area, 10)
        self.assertIs(spot.saturated, False)

    def test_covariance_tells_the_error(self):
        deviations = []
        for seed in range(40):
            spot = ptzcal.detect_spot(*spot_frames(seed=seed))
            error = spot.centre - CENTRE
            deviations.append(error @ np.linalg.solve(spot.covariance, error) / 2)
        self.assertClose(np.mean(deviations), 1.0, atol=0.6)

    def test_saturated(self):
        self.assertIs(ptzcal.detect_spot(*spot_frames(peak=400)).saturated, True)

    def test_several_frames(self):
        pairs = [spot_frames(seed=seed, peak=30) for seed in range(16)]
        on, off = [p[0] for p in pairs], [p[1] for p in pairs]
        averaged = ptzcal.detect_spot(on, off)
        self.assertClose(averaged.centre, CENTRE, atol=0.1)
        single = ptzcal.detect_spot(on[0], off[0])
        self.assertLess(np.trace(averaged.covariance), 0.3 * np.trace(single.covariance))
        self.assertClose(ptzcal.detect_spot(on, off[0]).centre, CENTRE, atol=0.3)

    def test_nothing_there(self):
        _, off = spot_frames()
        _, other = spot_frames(seed=2)
        with self.assertRaises(ptzcal.SpotNotFound) as caught:
            ptzcal.detect_spot(other, off)
        self.assertEqual(caught.exception.status, ptzcal.Status.NOT_FOUND)
        self.assertEqual(caught.exception.status_name, "NOT_FOUND")
        self.assertTrue(caught.exception.hint)
        self.assertIn(caught.exception.hint, str(caught.exception))
        self.assertIsNone(caught.exception.index)

    def two_spots(self):
        on, off = spot_frames()
        second, _ = spot_frames(centre=(60.0, 180.0), peak=110)
        return np.maximum(on, second), off

    def test_two_spots(self):
        with self.assertRaises(ptzcal.SpotAmbiguous):
            ptzcal.detect_spot(*self.two_spots())

    def test_region_and_band(self):
        on, off = self.two_spots()
        spot = ptzcal.detect_spot(on, off, region=(120, 50, 120, 100))
        self.assertClose(spot.centre, CENTRE, atol=0.1)
        spot = ptzcal.detect_spot(on, off, band=([(0, 100), (319, 90)], 20))
        self.assertClose(spot.centre, CENTRE, atol=0.1)
        other = ptzcal.detect_spot(on, off, region=(20, 140, 80, 80))
        self.assertClose(other.centre, (60, 180), atol=0.1)

    def test_options_are_for_many_calls(self):
        options = ptzcal.SpotOptions(region=(120, 50, 120, 100), colour="white", max_area=500)
        first = ptzcal.detect_spot(*self.two_spots(), options)
        second = ptzcal.detect_spot(*self.two_spots(), options)
        self.assertEqual((first.x, first.y), (second.x, second.y))

    def test_a_detector_for_many_frames(self):
        detector = ptzcal.SpotDetector(region=(120, 50, 120, 100))
        on, off = self.two_spots()
        expected = ptzcal.detect_spot(on, off, region=(120, 50, 120, 100))
        for _ in range(3):
            spot = detector.detect(on, off)
            self.assertEqual((spot.x, spot.y), (expected.x, expected.y))
            spot = detector.detect([on, on], [off, off])
            self.assertClose(spot.centre, expected.centre, atol=0.01)
        with self.assertRaises(ptzcal.SpotNotFound):
            detector.detect(off, off)
        with self.assertRaisesRegex(TypeError, "not both"):
            ptzcal.SpotDetector(ptzcal.SpotOptions(), max_area=5)

    def test_thresholds(self):
        on, off = spot_frames()
        with self.assertRaises(ptzcal.SpotNotFound):
            ptzcal.detect_spot(on, off, min_signal_to_noise=1e6)
        with self.assertRaises(ptzcal.Error):
            ptzcal.detect_spot(on, off, max_area=2)
        strong, weak = spot_frames(), spot_frames(centre=(60, 180), peak=40)
        both = np.maximum(strong[0], weak[0])
        self.assertClose(
            ptzcal.detect_spot(both, off, ambiguity_ratio=1.0).centre, CENTRE, atol=0.1
        )
        with self.assertRaises(ptzcal.SpotAmbiguous):
            ptzcal.detect_spot(both, off, ambiguity_ratio=0.02)

    def test_wrong_settings(self):
        on, off = spot_frames()
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.detect_spot(on, off, ambiguity_ratio=2)
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.SpotOptions(region=(0, 0, 0, 5))
        with self.fails("NOT_FINITE", index=1):
            ptzcal.SpotOptions(band=([(0, 0), (np.nan, 3), (9, 9)], 4))
        with self.assertRaisesRegex(ValueError, "region must be from 0 to"):
            ptzcal.SpotOptions(region=(-1, 0, 10, 10))
        with self.assertRaises(ValueError):
            ptzcal.SpotOptions(region=(1, 2, 3))
        with self.assertRaisesRegex(ValueError, r"\(n, 2\)"):
            ptzcal.SpotOptions(band=([1, 2, 3], 4))
        with self.assertRaisesRegex(ValueError, "red, green"):
            ptzcal.SpotOptions(colour="puce")
        with self.assertRaises(TypeError):
            ptzcal.SpotOptions(max_area=2.5)
        with self.assertRaises(TypeError):
            ptzcal.detect_spot(on, off, ptzcal.SpotOptions(), max_area=9)
        with self.assertRaises(TypeError):
            ptzcal.detect_spot(on, off, radius=9)

    def test_empty_lists(self):
        on, off = spot_frames()
        with self.fails("INVALID_ARGUMENT"):
            ptzcal.detect_spot([], [off])


if __name__ == "__main__":
    unittest.main()
