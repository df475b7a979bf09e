"""From samples to a frequency response with its coherence and its uncertainty.

windows:       gap-free samples cut into overlapping windows
window_check:  is a window fit to be used
period:        does the input repeat itself
spectra:       running auto and cross spectra, window by window
batch_spectra: the same sums over a whole recording at once
h1:            the H1 estimator
frf:           the frequency response that comes out
distortion:    how far from linear: lines that a multisine left free
friction_hint: does the input carry a part that follows the direction of motion
"""
