"""Where W is singular or missing: which motions and which reactions a load leaves open."""
