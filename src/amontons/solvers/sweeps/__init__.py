"""Contact after contact: Gauss-Seidel and Jacobi."""
