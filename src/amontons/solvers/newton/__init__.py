"""Newton's methods: semismooth, inexact, smoothing, interior point."""
