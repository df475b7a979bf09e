"""From samples to a frequency response with its coherence and its uncertainty.

windows:       gap-free samples cut into overlapping windows
window_check:  whether a window can be used
period:        whether the input is periodic
spectra:       running auto and cross spectra, window by window
batch_spectra: the same sums over a full recording at once
h1:            the H1 estimator
frf:           the resulting frequency response
distortion:    nonlinear distortion, on lines that a multisine left free
friction_hint: whether the input has a part that follows the direction of motion
"""
