"""The same model, fitted to the same material under two metrics.

usage: fit.py [MATERIAL [IMAGE.png]]

Ward's isotropic model (Ward 1992), written in NumPy, is fitted to a material of the built-in database
under the RMSE and under PAWCIELAB, and each is rendered beside the original. Needs NumPy and SciPy;
for the image Matplotlib and a Vulkan device (lavapipe will do)."""

import sys
import time

import numpy as np
from scipy.optimize import minimize

import merl_scan as ms

SHAPE = (30, 30, 60)  # a third as fine as MERL's, which is enough for a smooth model
METRICS = ("rmse", "pawcielab")

grid = ms.grid(SHAPE)
above = grid.above_horizon
tan2 = np.tan(grid.theta_h[above]) ** 2
root = np.sqrt(np.maximum(grid.cos_theta_i[above] * grid.cos_theta_o[above], 1e-4))


def ward(parameters):
    """(theta_h, theta_d, phi_d, 3): diffuse red, green and blue, specular red, green and blue, and the
    roughness, all as logarithms."""
    diffuse, specular, roughness = np.exp(parameters[:3]), np.exp(parameters[3:6]), np.exp(parameters[6])
    lobe = np.exp(-tan2 / roughness**2) / (4 * np.pi * roughness**2 * root)
    f = np.zeros((*SHAPE, 3))
    f[above] = diffuse / np.pi + lobe[:, np.newaxis] * specular
    return f


def main(name="gold-paint", image="fit.png"):
    material = ms.open(shape=SHAPE, materials=[name])[name]
    measured = material.samples()
    start = np.log([0.1] * 6 + [0.2])
    fits = {}
    for text in METRICS:
        metric = ms.Metric(text)
        begin = time.perf_counter()
        fit = minimize(lambda p: metric.distance(measured, ward(p)), start, method="Nelder-Mead",
                       options={"maxfev": 600, "xatol": 1e-3, "fatol": 1e-6, "adaptive": True})
        fits[text] = ward(fit.x)
        print(f"fitted under {text}: {fit.nfev} distances in {time.perf_counter() - begin:.1f} seconds, "
              f"roughness {np.exp(fit.x[6]):.3f}")
    print(f"{'':10}" + "".join(f"{text:>12}" for text in METRICS))
    for text, fitted in fits.items():
        print(f"{text:10}" + "".join(f"{ms.distance(other, measured, fitted):12.4g}" for other in METRICS))
    spheres = [ms.render(f, size=256) for f in (measured, *fits.values())]
    from matplotlib.image import imsave

    imsave(image, np.concatenate(spheres, axis=1))
    print(f"{image}: {name}, then fitted under {' and '.join(METRICS)}")


if __name__ == "__main__":
    main(*sys.argv[1:])
