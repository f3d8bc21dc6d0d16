"""V. Acary, M. Brémond, F. Dubois, CSMA 2017: Newton or Gauss-Seidel on an elastic wall."""
