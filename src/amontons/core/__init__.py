"""What everybody may use: errors, arrays, files, expressions, time, kernels."""
