"""First order methods: accelerated gradients, Uzawa."""
