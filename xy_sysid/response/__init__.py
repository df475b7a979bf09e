"""From samples to a frequency response with its coherence and its uncertainty.

windows:       gap-free samples cut into overlapping windows
window_check:  whether a window can be used
period:        whether the input is periodic
spectra:       running auto and cross spectra, window by window
batch_spectra: the same sums over a full recording at once
methods:       the estimators: h1, closed_loop (joint input-output), local_polynomial (and local rational)
best_linear:   the best linear approximation from several realisations
frf, algebra:  the resulting frequency response, and calculations with it
estimate:      an estimated number with its interval
given:         a frequency response measured elsewhere
coupling:      the 2 x 2 response of two axes
distortion:    nonlinear distortion, on lines that a multisine left free
friction_hint: whether the input has a part that follows the direction of motion
"""
