"""Makes the data by which feature points are found on photographs: `fba/face/fitting/front_features.npz`."""
