"""Finds the laser's spot in two pictures of the same view, one with the laser on and one with it off.

detect_spot.py                  pictures of the simulator
detect_spot.py ON.png OFF.png   needs OpenCV for Python
"""

import sys

import ptzcal


def simulated():
    simulator = ptzcal.Simulator("sim:room")
    off = simulator.next_frame().image
    simulator.set_laser(True)
    on = simulator.next_frame(not_before=simulator.now()).image
    simulator.set_laser(False)
    return on, off


def from_files(*paths):
    import cv2

    pictures = [cv2.imread(path) for path in paths]
    for path, picture in zip(paths, pictures):
        if picture is None:
            sys.exit(f"{path} is no picture")
    return pictures


def main():
    on, off = from_files(*sys.argv[1:3]) if len(sys.argv) > 2 else simulated()
    try:
        spot = ptzcal.detect_spot(on, off)
    except (ptzcal.SpotNotFound, ptzcal.SpotAmbiguous) as error:
        sys.exit(str(error))
    sigma_x, sigma_y = spot.covariance.diagonal() ** 0.5
    print(
        f"spot at ({spot.x:.2f} +- {sigma_x:.2f}, {spot.y:.2f} +- {sigma_y:.2f}) px, "
        f"signal to noise {spot.signal_to_noise:.0f}"
    )


if __name__ == "__main__":
    main()
